"""A VR network as the posterior's student: a policy of the thesis' form, of what was understood.

From a few labels a network alone learns little; from a plan that says what to do in every state it
learns all that f can say (3.15). So the plan labels the states, evenly among the actions that it
takes for equally good, and the network is fitted to these labels by their likelihood (3.19), with
caution. What depends on an action and not on where it leads, such as how far it turns, no f on
states can say: there the student falls short of its teacher, and may go round in circles between
states that each prefer the other. Where by the plan it would not arrive, it leans on what the plan
holds states to be worth (`irl.posterior.arriving`).
"""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from irl.choices import Limits, Settings
from irl.likelihood import LikelihoodProblem
from irl.policy import Policy
from irl.posterior.arriving import LEANINGS, SHORT, arrives
from irl.posterior.learner import GoalLearner
from irl.posterior.predictions import ALIKE
from irl.training import train
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction, pin, torch_generator


@dataclass(frozen=True)
class PlanStudentConfig(Settings):
    """The network, and how it is trained."""

    hidden: tuple[int, ...] = (64, 32)
    """Widths of the hidden layers."""
    training: TrainingConfig = field(
        default_factory=lambda: TrainingConfig(
            iterations=200, step=3e-3, beta=100.0, learn_caution=True
        )
    )
    """How it is trained on the labels of the plan."""
    leanings: Annotated[tuple[float, ...], Limits(0, 1e6, some=True)] = LEANINGS
    """How much of the plan's values may be added to the network's, tried in this order until by the
    plan it arrives from nearly all starts."""
    arriving: Annotated[float, Limits(0, 1e6)] = 2.0
    """How much the share of starts from which it arrives counts beside that of the states in which
    it does as the plan does: the best of what was tried is taken."""


@dataclass(frozen=True, eq=False)
class PlanStudent:
    """What the student knows.

    Attributes:
        network: the VR function.
        f: VR values, the network's and as much of the plan's values as it leans on, known ones in
            their places, float64 ``[n_states]``.
        caution: u, the dislike of uncertain outcomes.
        q: action values Σ P f − u · surprise, float64 ``[n_states, n_actions]``; −∞ where
            infeasible.
        leaning: how much of the plan's values is in f.
    """

    network: VRFunction
    f: np.ndarray
    caution: float
    q: np.ndarray
    leaning: float = 0.0


def taught(
    learner: GoalLearner,
    features: np.ndarray,
    *,
    rng: np.random.Generator,
    config: PlanStudentConfig | None = None,
) -> PlanStudent:
    """Fit a VR network to the plan of a learner.

    Args:
        learner: has learnt; its labels are of all states that it may ask about.
        features: what the network sees of the states, ``[n_states, d]``.
        rng: draws the weights that training begins from.
        config: the network, and how it is trained.

    Raises:
        InputError: if features are not the network's, or training diverges.
    """
    config = config or PlanStudentConfig()
    model, fixed_vr = learner.problem.model, learner.problem.fixed_vr
    state, action, weight = plan_labels(learner)
    problem = LikelihoodProblem.build(
        model, state, action, weight, fixed_vr, cautious=config.training.cautious
    )
    network = VRFunction(features.shape[1], config.hidden, generator=torch_generator(rng))
    run = train(network, problem, features, config.training, rng)
    own, value = network.values(features), plan_values(learner)
    good: list[tuple[float, PlanStudent]] = []
    for leaning in config.leanings:
        f = pin(own + leaning * value, fixed_vr)
        q = model.q_values(f, run.caution)
        share = arrives(model, q, np.flatnonzero(learner.arrived))
        reached = float(share[learner.problem.start_states].mean())
        agrees = _agrees(Policy.from_q(q, model.mask).action, state, action)
        student = PlanStudent(network, f, run.caution, q, leaning)
        good.append((config.arriving * reached + agrees, student))
        if reached >= 1.0 - SHORT:
            break
    return max(good, key=lambda each: each[0])[1]


def _agrees(chosen: np.ndarray, state: np.ndarray, action: np.ndarray) -> float:
    """In which share of labelled states a policy's action ``[n_states]`` is one of the labels."""
    right = np.unique(state[chosen[state] == action])
    return right.size / np.unique(state).size


def plan_values(learner: GoalLearner) -> np.ndarray:
    """What a learner's plan holds each state to be worth, float64 ``[n_states]``.

    Of an action the value by this is the plan's, but for what the action itself costs.
    """
    best = learner.q.max(axis=1)
    goes_on = np.isfinite(best) & ~learner.arrived
    return learner.reward + learner.problem.gamma * np.where(goes_on, best, 0.0)


def plan_labels(learner: GoalLearner) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What a learner would do, wherever it is likelier than not that there is something to do.

    Returns:
        States and actions, int64 ``[n]``, and weights, float64 ``[n]``, that sum to 1 in each
        state.
    """
    q, states = learner.q, learner.candidates
    states = states[~learner.arrived[states]]
    good = q[states] >= q[states].max(axis=1, keepdims=True) - ALIKE
    row, action = np.nonzero(good)
    return states[row], action, 1 / good.sum(axis=1)[row]
