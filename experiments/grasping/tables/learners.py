"""The thesis' network as it seems to have been, ours, and what lies between the two."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from experiments.grasping.learning import LearningConfig
from irl.active import ActiveConfig
from irl.mdp import TransitionModel
from irl.problem import LearningProblem
from irl.training_config import TrainingConfig

_THESIS_TRAINING = TrainingConfig(iterations=10_000, beta=1.0, schedule="none")
_SHORT = TrainingConfig(iterations=3000, step=3e-3, beta=1.0)
ENDLESS = 1_000_000
"""Questions, where the number of demonstrated states is the limit."""


@dataclass(frozen=True)
class Learner:
    """One way to learn.

    Attributes:
        learning: every choice of Algorithm 4.1.
        everything: whether actions that cannot be done are left in, at Q = 0.
    """

    learning: LearningConfig = field(default_factory=LearningConfig)
    everything: bool = False

    def with_active(self, **changes: Any) -> "Learner":
        """The same with other choices of `ActiveConfig`."""
        active = replace(self.learning.active, **changes)
        return replace(self, learning=replace(self.learning, active=active))

    def with_training(self, **changes: Any) -> "Learner":
        """The same with other choices of the first training."""
        return self.with_active(initial=replace(self.learning.active.initial, **changes))

    def with_learning(self, **changes: Any) -> "Learner":
        """The same with other features, demonstrations or rules."""
        return replace(self, learning=replace(self.learning, **changes))


OURS = Learner().with_active(budget=ENDLESS)
THESIS = Learner(
    LearningConfig(
        features="thesis",
        least_purity=0.0,
        active=ActiveConfig(
            initial=_THESIS_TRAINING,
            refine=replace(_THESIS_TRAINING, iterations=100),
            budget=ENDLESS,
            state_query="thesis_entropy",
            cluster_query="thesis_entropy",
            avoid="thesis",
            prefer="thesis",
            state_preferences=False,
        ),
    ),
    everything=True,
)
LEARNERS: Mapping[str, Learner] = {"fa_mlirl": OURS, "thesis": THESIS}
"""The methods of Table 6.3. The thesis is silent about the optimiser: Adam, a step of 0.001."""


def ladder() -> dict[str, Learner]:
    """From the thesis' network to ours, each rung with one change more than the one before."""
    rungs = {"as in the thesis": THESIS}

    def change(name: str, make: "Learner") -> None:
        rungs[name] = make

    last = replace(THESIS.with_active(initial=_SHORT, hidden=(64, 32)))
    change("64–32 units, 3,000 iterations of a step that decays from 0.003", last)
    change("what cannot be done is left out", last := replace(last, everything=False))
    change("β = 30", last := last.with_training(beta=30.0))
    change("rules only where runs bear them out", last := last.with_learning(least_purity=0.95))
    change("rotations as matrices", last := last.with_learning(features="rotation"))
    change(
        "a column for each position and orientation",
        last := last.with_learning(features="factored"),
    )
    change("caution, learnt", last := last.with_training(learn_caution=True))
    change(
        "a penalty on all states, 200 iterations",
        last := last.with_active(
            initial=OURS.learning.active.initial, refine=OURS.learning.active.refine
        ),
    )
    change("the policy planned anew", last.with_active(policy_update="planned"))
    return rungs


def with_everything(problem: LearningProblem) -> LearningProblem:
    """A problem in which every action can be done, and the impossible ones lead nowhere.

    *Nowhere* is one state more, the last, whose f is held at 0: Q = 0 there, as in an array that
    was never filled in.
    """
    model, n = problem.model, problem.model.n_states
    state, action = np.nonzero(~model.mask & (model.widths > 0)[:, np.newaxis])
    entries = model.P.tocoo()
    bigger = TransitionModel.from_entries(
        n + 1,
        model.n_actions,
        np.r_[model.pair_state[entries.row], state],
        np.r_[model.pair_action[entries.row], action],
        np.r_[entries.col, np.full(state.size, n)],
        np.r_[entries.data, np.ones(state.size)],
    )
    features = problem.required_features()
    return replace(
        problem,
        model=bigger,
        features=np.concatenate([features, np.zeros_like(features[:1])]),
        fixed_vr={**problem.fixed_vr, n: 0.0},
        costs={},
        factors={},
    )
