"""A session of whichever learner a lesson has."""

from dataclasses import replace

import numpy as np

from irl.active_config import ActiveConfig
from irl.advice import Advice
from irl.choices import check_choice, made
from irl.clusters import with_intersections
from irl.demonstrations import Demonstrations
from irl.methods import METHODS
from irl.posterior.learner import GoalConfig
from irl.session import Session
from irl.session_goals import GoalSession
from irl.session_methods import MethodSession
from irl.session_network import NetworkSession, begin
from irl.student import StudentConfig, Subject
from irl.taught_state import TaughtState
from irl.teacher import Teacher


def begin_session(
    subject: Subject, config: StudentConfig, initial: Demonstrations, k: int = 0
) -> Session:
    """A session of the configured learner that sets out in round ``k``, knowing nothing else.

    Raises:
        InputError: if the learner, an option or a rule is unknown.
    """
    check_choice("method", config.method, METHODS)
    problem = subject.problem
    # The first begins as `active_fa_mlirl` does with a generator of this seed.
    rng = np.random.default_rng([config.seed, k] if k else config.seed)
    teacher = Teacher(None, None, subject.generalisation, list(config.rules))  # type: ignore[arg-type]
    options = dict(config.options)
    if config.method == "fa_mlirl":
        active = made(ActiveConfig, options, "options")
        problem = replace(problem, features=problem.required_features(np.float32))
        network = begin(problem, initial, active, rng, advised=False)
        return NetworkSession(problem, network, active, teacher.generalise)
    state = TaughtState(
        initial,
        Advice.none(problem.model.n_states, problem.model.n_actions),
        with_intersections(problem.clusters, 0),
        rng,
    )
    if config.method == "goal_posterior":
        return GoalSession(problem, state, teacher.generalise, made(GoalConfig, options, "options"))
    strategy = options.pop("strategy", "visitation_entropy")
    return MethodSession(config.method, problem, state, teacher.generalise, strategy, options)
