"""Every method by its key, called alike: for a new task, one loop tries them all.

    for name in METHODS:
        learnt = learn(name, LearningProblem.of(task, "rotation"), demonstrations, rng=rng)
        policy = Policy.from_q(learnt.q, task.model.mask)

A transition model will do in place of a learning problem, with features and a discount factor:
``learn(name, model, demonstrations, features, gamma=0.95, rng=rng)``.

What the methods make of the same arguments:

| key | learns | features |
|---|---|---|
| fa_mlirl | a VR network f (3.15), likelihood (3.19) | network's input |
| max_ent | a reward per state, maximum causal entropy | unused |
| deep_max_ent | a reward network, maximum causal entropy | network's input |
| bellman_gradient | a reward per state, smoothed Bellman equation | unused |
| linear_mlirl | a reward per state, likelihood (3.13) of Boltzmann choices | unused |
| lp | a reward per state, largest margins (3.7) | unused |
| lp_advice | a reward per state, margins and advice (3.9) | unused |
| lp_basis | R = Φ ω, largest margins (3.12) | where Φ has bumps |
| birl | a reward per state, mean of its posterior | unused |
| behaviour_cloning | no reward: a softmax of the demonstrated actions | classifier's input |
| planning | a sparse reward per state, soft planning; caution | unused |
| goal_posterior | a posterior over goals and sizes of costs, hard planning | unused |

Of features of pairs, ``[n_states, n_actions, d]``, some methods learn a reward of pairs, earned by
acting: the methods in ``OF_PAIRS``, all linearly, r = Φ ω, but for deep_max_ent's network. What an
action costs needs it; a reward of states cannot tell. The other methods refuse such features.

Φ of (3.12) is the option ``basis`` if given, one indicator per state on small tasks, and on large
ones Gaussian bumps over the features, as many, as wide and where the demonstrations ask for them
(`irl.baselines.lp_bumps`). Action values are optimal for the reward learnt, (3.1)–(3.3).
Advice enters (3.9) as constraints; the other methods take it afterwards, by UpdateQ of Algorithm
4.1. VR values known beforehand (``LearningProblem.fixed_vr``) are for fa_mlirl, which alone learns
VR values; state preferences and clusters are for ``irl.active``. ``max_ent`` and ``deep_max_ent``
match what was demonstrated, and see no generalised pairs.

Where only states were recorded, `irl.state_only` infers the actions, for the methods that can do
with shares of a label: all but the linear programs and birl.

The linear programs ask for the best action of every state, and demonstrations tell some. Their
margins range over the demonstrated states: completing the policy by a guess would make the program
explain the guess. Elsewhere they value a guess first, that a run ends there (3.7) or even choices
(3.9), (3.12), and then the best actions under the reward found.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from irl import linear_programs, method_fits, method_iterations, vr_fit
from irl.advice import Advice
from irl.baselines.ascent import RidgeConfig
from irl.baselines.bellman_gradient import (
    SHARPNESS,
    BellmanGradientConfig,
    smooth_maximum,
)
from irl.baselines.birl import birl
from irl.baselines.deep_max_ent import DeepMaxEntConfig
from irl.baselines.differentiable_planning import HardMax, SoftMax
from irl.baselines.linear_mlirl import MlirlConfig, linear_mlirl
from irl.baselines.linear_programming import lp
from irl.baselines.lp_advice import TrustConfig
from irl.baselines.lp_basis import lp_basis
from irl.baselines.sparse_planning import SparseConfig
from irl.choices import check_choice
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.method_inputs import Found, Inputs, Progress, option_names
from irl.method_iterations import Iteration, Prepare, planned
from irl.planning import value_iteration
from irl.posterior.learner import GoalConfig
from irl.problem import LearningProblem


@dataclass(frozen=True, eq=False)
class Learnt:
    """What a method learnt.

    Attributes:
        q: action values, float64 ``[n_states, n_actions]``, advice included, −∞ where infeasible
            or excluded; the policy is their argmax.
        reward: float64 ``[n_states]``, earned on entering a state, or ``[n_states, n_actions]``,
            earned by acting, 0 where infeasible; None if none was learnt.
        seconds: wall time.
        iterations: evaluations of the objective, training steps, or programs solved.
        converged: whether the method ended where it wanted to; False if the iterations that it
            was allowed ended it; None if it always takes as many.
        note: what else is to be known, in one line: that there is no preference, or that
            demonstrated actions are not the best ones under the reward found.
        lower: with no preference, the options to learn with in place of those that led to it,
            such as a lower penalty: ``learn(..., **learnt.lower)``; may be empty.
        caution: u, the dislike of uncertain outcomes that ``planning`` learns beside a reward of
            states (`irl.caution`), in its unit: acting earns Σ P R − u (1 − max P). 0 of others.
    """

    q: np.ndarray
    reward: np.ndarray | None
    seconds: float
    iterations: int | None
    converged: bool | None = None
    note: str = ""
    lower: Mapping[str, float] = field(default_factory=dict)
    caution: float = 0.0

    @property
    def no_preference(self) -> bool:
        """Whether the reward is 0 everywhere: then no policy is better than another."""
        return self.reward is not None and not self.reward.any()


@dataclass(frozen=True)
class Method:
    """A way to learn from demonstrations.

    Attributes:
        fit: from what it is given and its own options to what it found.
        takes: what takes its options: functions, or classes of settings.
        iterate: prepares iterations to be taken one by one; None for a method that has none.
        takes_advice: whether the method uses the advice itself.
        penalty: what to change if the reward is 0 everywhere, as a user would be told.
    """

    fit: Callable[..., Found]
    takes: tuple[Callable[..., Any], ...]
    iterate: Prepare | None = None
    takes_advice: bool = False
    penalty: str = ""

    def step(self, given: Inputs) -> Iteration:
        """Prepare one iteration: an evaluation of the objective, its gradient and a step along it.

        To time it, call the result a few times first: the first call meets a reward of 0.

        Returns:
            A function without arguments; each call goes one iteration further.

        Raises:
            InputError: if the method does not iterate, or a demonstration is invalid.
        """
        if given.problem.pair_features is not None:
            raise InputError("features of pairs are for learn", place="step")
        if self.iterate is None:
            valid = ", ".join(name for name, method in METHODS.items() if method.iterate)
            raise InputError(f"step: this method does not iterate; those that do: {valid}")
        return self.iterate(given)


def learn(
    name: str,
    problem: LearningProblem | TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float | None = None,
    rng: np.random.Generator,
    **options: Any,
) -> Learnt:
    """Learn by the method of that name.

    Args:
        name: a key of ``METHODS``.
        problem: what is known beforehand; or the transition model alone, beside ``features`` and
            ``gamma``.
        demonstrations: labelled pairs.
        features: ``[n_states, d]``, or of pairs ``[n_states, n_actions, d]``, of a size near 1;
            used as said above.
        gamma: discount factor in [0, 1).
        rng: the only source of chance.
        options: ``advice``, an ``irl.advice.Advice``; ``progress``, called after each iteration
            with the number done and the objective's value, which may end the learning by raising
            (birl tells of rewards kept, linear programs of programs solved); and those of the
            method itself, in place of its defaults.

    Raises:
        InputError: if the name is unknown, features are missing or not for this method, or an
            input is invalid.
    """
    check_choice("method", name, METHODS)
    method, advice = METHODS[name], options.pop("advice", None)
    progress: Progress | None = options.pop("progress", None)
    given = Inputs(_problem(problem, features, gamma), demonstrations, rng, advice, progress)
    of_pairs = given.problem.pair_features is not None
    if of_pairs and name not in OF_PAIRS:
        raise InputError(
            f"{name} learns no reward of pairs, and features [n_states, n_actions, d] were given",
            place="method",
            valid=OF_PAIRS,
        )
    if not isinstance(demonstrations, Demonstrations):
        raise InputError(
            f"Demonstrations wanted, got {type(demonstrations).__name__}; from runs of states "
            "without actions learns irl.state_only.learn_from_states",
            place="demonstrations",
        )
    if not isinstance(rng, np.random.Generator):
        raise InputError("numpy.random.default_rng(seed) wanted", place="rng")
    if not isinstance(advice, Advice | None):
        raise InputError(f"Advice wanted, got {type(advice).__name__}", place="advice")
    if progress is not None and not callable(progress):
        raise InputError(f"a function wanted, got {type(progress).__name__}", place="progress")
    for option in options:
        check_choice(f"{name}: option", option, option_names(*method.takes))
    demonstrations.check(given.model, "demonstrations")
    began = time.perf_counter()
    found = method.fit(given, **options)
    q, reward, note = found.q, found.reward, found.note
    if of_pairs and reward is not None:
        reward = given.model.table(reward, fill=0.0)
    if not note and not (given.model.widths[demonstrations.state] > 1).any():
        note = "no preference: no demonstrated state offers a choice of actions"
    if reward is not None and not reward.any():
        q = np.where(given.model.mask, 0.0, -np.inf)
        note = note or f"no preference: R = 0{method.penalty and f'; {method.penalty}'}"
    if q is None:
        assert reward is not None
        doubt = found.caution * given.model.surprise if found.caution else 0.0
        _, q = value_iteration(given.model, reward, given.gamma, pair_reward=-doubt)
    if advice is not None and not method.takes_advice:
        q = advice.apply(q, given.model.mask)
    seconds = time.perf_counter() - began
    found = replace(found, q=q, reward=reward, note=note)
    return Learnt(seconds=seconds, **vars(found))


def _problem(
    problem: LearningProblem | TransitionModel, features: np.ndarray | None, gamma: float | None
) -> LearningProblem:
    """The learning problem, made of its parts if it comes in parts."""
    if isinstance(problem, LearningProblem):
        if features is not None or gamma is not None:
            raise InputError("features, gamma: the learning problem has its own; give one of both")
        return problem
    if gamma is None:
        raise InputError("gamma: a discount factor in [0, 1) wanted beside a transition model")
    return LearningProblem(problem, features, gamma=gamma)


METHODS: Mapping[str, Method] = {
    "fa_mlirl": Method(vr_fit.likeliest, (vr_fit.NetworksConfig,), method_iterations.fa_mlirl),
    "max_ent": Method(
        method_fits.matched, (RidgeConfig,), method_iterations.max_ent, penalty="lower l2"
    ),
    "deep_max_ent": Method(
        method_fits.matched_by_network, (DeepMaxEntConfig,), method_iterations.deep_max_ent
    ),
    "bellman_gradient": Method(
        method_fits.counted(linear_mlirl, BellmanGradientConfig),
        (BellmanGradientConfig,),
        planned(smooth_maximum("soft", SHARPNESS)),
    ),
    "linear_mlirl": Method(
        method_fits.counted(linear_mlirl, MlirlConfig), (MlirlConfig,), planned(HardMax())
    ),
    "lp": Method(linear_programs.largest_margins, (linear_programs.largest_margins, lp)),
    "lp_advice": Method(
        linear_programs.with_advice,
        (TrustConfig,),
        takes_advice=True,
        penalty="raise demonstration_trust or advice_trust",
    ),
    "lp_basis": Method(linear_programs.over_basis, (linear_programs.over_basis, lp_basis)),
    "birl": Method(method_fits.sampled, (method_fits.sampled, birl), method_iterations.birl),
    "behaviour_cloning": Method(
        method_fits.cloned, (RidgeConfig,), method_iterations.behaviour_cloning
    ),
    "planning": Method(
        method_fits.planned,
        (SparseConfig,),
        planned(SoftMax()),
        penalty="lower sparsity",
    ),
    "goal_posterior": Method(method_fits.goals, (GoalConfig,)),
}
OF_PAIRS = (*("max_ent", "deep_max_ent", "bellman_gradient", "linear_mlirl", "birl", "planning"),)
"""Methods that learn a reward of pairs from features of pairs."""
