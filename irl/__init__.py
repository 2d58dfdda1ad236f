"""Active advice inverse reinforcement learning on sparse transition models.

Knows nothing of robots: transition models and demonstrations in, policies out. Needs torch, numpy
and scipy. What a user needs is here, loaded when first used:

| name | what it is for |
|---|---|
| `TaskData`, `load_task`, … | a task as a folder of plain files, or made in Python |
| `LearningProblem` | what is known before anyone demonstrates |
| `Demonstrations` | labelled pairs of state and action |
| `Teacher` | who answers questions: a demonstrator, an expert |
| `active_fa_mlirl` | thesis Algorithm 4.1: learn, ask for what is least certain, learn |
| `learn`, `METHODS` | that method without questions, and every other, called alike |
| `Policy`, `save_policy`, … | what comes of it |
| `success_mdp` | how good it is |

>>> import numpy as np
>>> from irl import Demonstrations, TransitionModel, learn
>>> room = np.arange(6)  # a corridor: action 0 goes left, 1 goes right, 2 stays
>>> state = np.r_[room[1:], room[:-1], room]
>>> action = np.repeat([0, 1, 2], [5, 5, 6])
>>> after = np.r_[room[:-1], room[1:], room]
>>> model = TransitionModel.from_entries(6, 3, state, action, after, np.ones(16))
>>> shown = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1), (3, 2)])
>>> learnt = learn("planning", model, shown, gamma=0.9, rng=np.random.default_rng(0))
>>> learnt.q.argmax(axis=1)  # rooms 4 and 5 were never shown
array([1, 1, 1, 2, 0, 0])

The modules in reading order. A task: `mdp`, `task`, `task_data`, `gymnasium_interop`, `domains`.
Teaching: `demonstrations`, `runs`, `records`, `tables`, `demonstrators`, `experts`,
`generalisation`, `collection`, `teacher`, `problem`. The network and its training: `vr_function`,
`likelihood`, `neighbourhood`, `bellman`, `optimizers`, `training_config`, `training`,
`function_approx`. Questions and advice: `uncertainty`, `queries`, `asking`, `committee`,
`clusters`, `cluster_queries`, `preferences`, `advice`, `active`, `active_state`. Lessons by a
person: `lesson_events`, `lesson_taught`, `session` (with one module for each kind of learner),
`student`, `lesson`, `lesson_replay`, `lesson_exchange`, `lesson_merge`, `lesson_odds`. Every
method: `methods`, `method_inputs`, `method_iterations`, `baselines`, `state_only`. Judging:
`rewards`, `planning`, `evaluation`, `metrics`, `policy`, `outcomes`. The rest is small tools:
files, hashes, checks.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from irl.active import ActiveConfig, active_fa_mlirl
    from irl.advice import Advice
    from irl.demonstrations import Demonstrations
    from irl.demonstrators import OracleDemonstrator, RecordedDemonstrator
    from irl.errors import InputError
    from irl.experts import ClusterAdvice, OracleExpert
    from irl.mdp import TransitionModel
    from irl.methods import METHODS, learn
    from irl.metrics import success_mdp
    from irl.policy import Policy, load_policy, save_policy
    from irl.problem import LearningProblem
    from irl.task_data import TaskData, Transitions, load_task, save_task
    from irl.teacher import Teacher
    from irl.training_config import TrainingConfig

__version__ = "0.1.0"
__all__ = [
    "METHODS",
    "ActiveConfig",
    "Advice",
    "ClusterAdvice",
    "Demonstrations",
    "InputError",
    "LearningProblem",
    "OracleDemonstrator",
    "OracleExpert",
    "Policy",
    "RecordedDemonstrator",
    "TaskData",
    "Teacher",
    "TrainingConfig",
    "TransitionModel",
    "Transitions",
    "active_fa_mlirl",
    "learn",
    "load_policy",
    "load_task",
    "save_policy",
    "save_task",
    "success_mdp",
]

_HOMES = {
    "active": ("ActiveConfig", "active_fa_mlirl"),
    "advice": ("Advice",),
    "demonstrations": ("Demonstrations",),
    "demonstrators": ("OracleDemonstrator", "RecordedDemonstrator"),
    "errors": ("InputError",),
    "experts": ("ClusterAdvice", "OracleExpert"),
    "mdp": ("TransitionModel",),
    "methods": ("METHODS", "learn"),
    "metrics": ("success_mdp",),
    "policy": ("Policy", "load_policy", "save_policy"),
    "problem": ("LearningProblem",),
    "task_data": ("TaskData", "Transitions", "load_task", "save_task"),
    "teacher": ("Teacher",),
    "training_config": ("TrainingConfig",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Load a name of `__all__` from its module, at its first use."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Every name there is, loaded or not."""
    return sorted({*globals(), *__all__})
