"""Learning to sail from demonstrations and advice: one seed's share of the experiment.

The learner is FA-MLIRL (thesis §3.7.1) with a VR function that is linear in the domain's features,
f = Φ θ, so that each fit has one answer and takes milliseconds. Advice acts on the action values,
as in Algorithm 4.1: preferred actions gain, avoided ones are excluded. If it is also part of the
*objective*, as in Kunapuli et al. (2013) and Odom & Natarajan (2016), a preferred action counts as
a label in every state of its cluster, and each answer is followed by another fit.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Annotated, Protocol

import numpy as np

from irl.advice import Advice
from irl.baselines.ascent import RidgeConfig, ridge_ascend
from irl.choices import Limits, Settings
from irl.cluster_queries import select_part
from irl.collection import demonstrate, mislabel
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.sailing import Sailing, ideal_clusters, purity, shuffled_clusters
from irl.errors import InputError
from irl.experts import ClusterAdvice, OracleExpert
from irl.likelihood import LikelihoodProblem
from irl.planning import policy_success, uniform_policy
from irl.uncertainty import entropy

STRATEGIES = ("random_advice", "uncertain_state", "uncertain_cluster", "random_cluster")
NOISE_CURVES = ("demonstrations", "advice", "wrong_advice")


@dataclass(frozen=True, eq=False)
class Problem:
    """A lake, its perfect sailor, and the scale on which policies are measured."""

    lake: Sailing
    gamma: float
    prefer_share: float
    avoid_share: float

    @cached_property
    def sailor(self) -> OracleDemonstrator:
        """Who demonstrates."""
        return self.lake.demonstrator(self.gamma)

    @cached_property
    def expert(self) -> OracleExpert:
        """Who advises."""
        everywhere = np.flatnonzero(~self.lake.at_goal)
        return OracleExpert(self.sailor, everywhere, self.prefer_share, self.avoid_share)

    def minutes(self, policy: np.ndarray) -> float:
        """Discounted minutes to the goal, averaged over the starts."""
        return float(self.lake.minutes_to_goal(policy, self.gamma)[self.lake.starts].mean())

    @cached_property
    def scale(self) -> tuple[float, float]:
        """Minutes of the policy that picks any feasible leg, and of the optimal one."""
        any_leg, best = self.lake.model.mask, self.sailor.optimal_actions
        return self.minutes(uniform_policy(any_leg)), self.minutes(uniform_policy(best))

    def performance(self, policy: np.ndarray) -> float:
        """1 for the optimal policy, 0 for any feasible leg at random, linear in the minutes."""
        random, optimal = self.scale
        return (random - self.minutes(policy)) / (random - optimal)

    def goal_reached(self, policy: np.ndarray) -> float:
        """Probability of reaching the goal within 4 n legs, averaged over the starts."""
        lake = self.lake
        reached = policy_success(lake.model, policy, lake.goal_states, 4 * lake.n)
        return float(reached[lake.starts].mean())

    def demonstrate(self, trajectories: int, rng: np.random.Generator) -> Demonstrations:
        """Perfect trajectories from random starts."""
        return demonstrate(self.sailor, rng.choice(self.lake.starts, trajectories), rng)


class Advised(Protocol):
    """Learns from demonstrations, and from one answer of an expert after another."""

    @property
    def policy(self) -> np.ndarray:
        """The best action of every state, int64 ``[n_states]``."""
        ...

    @property
    def uncertainty(self) -> np.ndarray:
        """How unsure it is of each state's action, float64 ``[n_states]``."""
        ...

    def take(self, states: np.ndarray, answer: ClusterAdvice) -> None:
        """Take in one more answer about a cluster of states."""
        ...


class Learner:
    """FA-MLIRL with a linear VR function, demonstrations and advice."""

    def __init__(
        self, lake: Sailing, demonstrations: Demonstrations, l2: float, objective: bool
    ) -> None:
        """Learn from the demonstrations alone; ``objective``: from advice too, once given."""
        self._lake, self._l2, self._objective = lake, l2, objective
        self._state, self._action = [demonstrations.state], [demonstrations.action]
        self._advice = Advice.none(lake.n_states, lake.model.n_actions)
        self._weights = np.zeros(lake.features.shape[1])
        self._fit()

    def _fit(self) -> None:
        """Maximise Σ log π(label | s) − l2 |θ|² / 2, concave in θ, from the last answer."""
        problem = LikelihoodProblem.build(
            self._lake.model, np.concatenate(self._state), np.concatenate(self._action)
        )
        phi = self._lake.features[problem.states]
        labels = sum(s.size for s in self._state)

        def objective(weights: np.ndarray) -> tuple[float, np.ndarray]:
            value, df, _ = problem.value_and_gradient(phi @ weights, 1.0)
            return labels * value, labels * (phi.T @ df)

        config = RidgeConfig(tolerance=1e-3, max_iterations=200, l2=self._l2)
        self._weights = ridge_ascend(objective, self._weights, config, ftol=1e-8)
        self._learnt_q = self._lake.model.q_values(self._lake.features @ self._weights)

    def take(self, states: np.ndarray, answer: ClusterAdvice) -> None:
        """See ``Advised``."""
        self._advice = self._advice.add(states, answer.preferred, answer.avoided)
        if not self._objective:
            return
        for action in sorted(answer.preferred):
            feasible = states[self._lake.model.mask[states, action]]
            self._state.append(feasible)
            self._action.append(np.full(feasible.size, action))
        self._fit()

    @property
    def q(self) -> np.ndarray:
        """Action values, advice included; float64 ``[n_states, 8]``, −∞ where excluded."""
        return self._advice.apply(self._learnt_q, self._lake.model.mask)

    @property
    def policy(self) -> np.ndarray:
        """The best action of every state, int64 ``[n_states]``."""
        return self.q.argmax(axis=1)

    @property
    def uncertainty(self) -> np.ndarray:
        """Entropy (4.1) of each state's action probabilities, float64 ``[n_states]``."""
        return entropy(self.q)


def ask(
    problem: Problem,
    learner: Advised,
    clusters: np.ndarray,
    uncertain: bool,
    rng: np.random.Generator,
    wrong: float = 0.0,
) -> Iterator[int]:
    """Put one query after another to the expert; yields how many, until none is left.

    With probability ``wrong`` an answer prefers an action the expert would have avoided, and
    says nothing else.
    """
    asked: list[int] = []
    while True:
        uncertainty = learner.uncertainty if uncertain else None
        chosen = select_part(clusters, np.array(asked, int), uncertainty, rng)
        if chosen is None:
            return
        states = np.flatnonzero(clusters == chosen)
        advice = problem.expert.advise(str(chosen), states)
        if wrong and rng.random() < wrong:
            avoided = sorted(advice.avoided)
            advice = ClusterAdvice(frozenset({int(rng.choice(avoided))} if avoided else ()))
        learner.take(states, advice)
        asked.append(chosen)
        yield len(asked)


@dataclass(frozen=True)
class Plan(Settings):
    """What every seed does."""

    size: Annotated[int, Limits(2, 100)] = 6
    """The lake's side in waypoints; a state is a waypoint, a wind and a tack: 24 n² of them."""
    delay: Annotated[float, Limits(0, 1e6)] = 3.0
    """How many minutes a change between port and starboard tack takes."""
    gamma: Annotated[float, Limits(0, 0.999)] = 0.95
    """The discount factor of a leg; nearer to 1, evaluations would not end in good time."""
    demonstrations: Annotated[int, Limits(1, 1_000_000)] = 2
    """With how many optimal trajectories from random starts the learner begins."""
    objective_queries: Annotated[int, Limits(1, 1_000_000)] = 24
    """How many queries at most where advice is in the objective; elsewhere, one for each state."""
    advise_queries: Annotated[int, Limits(0, 1_000_000)] = 0
    """How many queries ADVISE puts, which plans for each reward that it tries; 0 leaves it out."""
    birl_queries: Annotated[int, Limits(0, 1_000_000)] = 0
    """How many states Bayesian IRL asks about, planning for many rewards; 0 leaves it out."""
    qualities: Annotated[tuple[float, ...], Limits(0, 1, some=True)] = (1.0, 0.75, 0.5, 0.25, 0.0)
    """Which shares of the states keep their place in the ideal clustering; the ideal, 1, first."""
    noise: Annotated[tuple[float, ...], Limits(0, 1, some=True)] = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
    """Which shares of the demonstrated labels are wrong."""
    noise_demonstrations: Annotated[int, Limits(1, 1_000_000)] = 8
    """How many trajectories there are with noise, enough to do well without advice or noise."""
    noise_queries: Annotated[int, Limits(1, 1_000_000)] = 20
    """How many queries there are with noise, each about the most uncertain cluster."""
    prefer_share: Annotated[float, Limits(0, 1)] = 0.5
    """An action optimal in at least this share of a cluster is preferred."""
    avoid_share: Annotated[float, Limits(0, 1)] = 0.0
    """An action optimal in at most this share of a cluster is avoided."""
    l2: Annotated[float, Limits(0, 1e9, open_low=True)] = 0.1
    """The price of |θ|² / 2 against the log-likelihood of the labels."""

    def __post_init__(self) -> None:
        """Refuse values outside their limits, and a lake or an expert that cannot be.

        Raises:
            InputError: naming the field.
        """
        super().__post_init__()
        if self.qualities[0] != 1:
            raise InputError(
                f"the first must be 1, the ideal, is {self.qualities[0]}", place="qualities"
            )
        self.problem.expert  # noqa: B018 - checks size, delay and shares before any work

    @property
    def problem(self) -> Problem:
        """The lake and its people."""
        lake = Sailing(self.size, delay=self.delay)
        return Problem(lake, self.gamma, self.prefer_share, self.avoid_share)

    @property
    def points(self) -> np.ndarray:
        """Numbers of queries at which policies are measured: ever sparser, to every state."""
        states = (self.size**2 - 1) * 24
        return np.unique(np.r_[0:41, np.geomspace(41, states, 30).round().astype(int)])

    @property
    def objective_points(self) -> np.ndarray:
        """The same where advice enters the objective."""
        return np.arange(self.objective_queries + 1)


def measure(
    problem: Problem, learner: Advised, queries: Iterator[int], points: np.ndarray
) -> np.ndarray:
    """Performance and arrival after each number of queries in ``points``, ``[2, len(points)]``.

    The last values stand where the queries run out earlier.
    """

    def row() -> tuple[float, float]:
        return problem.performance(learner.policy), problem.goal_reached(learner.policy)

    rows, latest = [row()], 0
    for number in queries:
        latest = number
        if number == points[len(rows)]:
            rows.append(row())
        if len(rows) == points.size:
            break
    if latest < points[-1]:
        rows += [row()] * (points.size - len(rows))
    return np.array(rows).T


def run_seed(plan: Plan, seed: int) -> dict[str, np.ndarray]:
    """All curves of one seed.

    Returns:
        ``STRATEGY`` and ``STRATEGY/goal`` at ``plan.points``, and ``STRATEGY/objective`` at
        ``plan.objective_points``; ``quality/i`` at ``plan.points`` and ``purity`` for each
        quality; ``noise/CURVE`` for each noise level.
    """
    problem, result = plan.problem, {}
    lake = problem.lake
    shown = problem.demonstrate(plan.demonstrations, np.random.default_rng([seed, 0]))

    def curve(clusters: np.ndarray, uncertain: bool, key: int, objective: bool) -> np.ndarray:
        learner = Learner(lake, shown, plan.l2, objective)
        queries = ask(problem, learner, clusters, uncertain, np.random.default_rng([seed, key]))
        points = plan.objective_points if objective else plan.points
        return measure(problem, learner, queries, points)

    states = np.where(lake.at_goal, -1, np.arange(lake.n_states))
    sectors = lake.sectors()
    for key, name in enumerate(STRATEGIES, start=1):
        clusters = sectors if name.endswith("cluster") else states
        uncertain = name.startswith("uncertain")
        result[name], result[f"{name}/goal"] = curve(clusters, uncertain, key, objective=False)
        result[f"{name}/objective"], _ = curve(clusters, uncertain, key, objective=True)

    optimal = problem.sailor.optimal_actions
    ideal = ideal_clusters(optimal, lake.states[:, 2])
    pure = []
    for i, quality in enumerate(plan.qualities):
        # One stream for all qualities, so that they differ in nothing but the share moved.
        clusters = shuffled_clusters(ideal, quality, np.random.default_rng([seed, 10]))
        pure.append(purity(clusters, optimal))
        result[f"quality/{i}"], _ = curve(clusters, True, 11, objective=False)
    result["purity"] = np.array(pure)

    shown = problem.demonstrate(plan.noise_demonstrations, np.random.default_rng([seed, 20]))
    worse = lake.model.mask & ~optimal
    noisy: dict[str, list[float]] = {name: [] for name in NOISE_CURVES}
    for share in plan.noise:
        labels = mislabel(shown, worse, share, np.random.default_rng([seed, 21]))
        for name in NOISE_CURVES:
            learner = Learner(lake, labels, plan.l2, objective=False)
            if name != "demonstrations":
                wrong = share if name == "wrong_advice" else 0.0
                rng = np.random.default_rng([seed, 22])
                queries = ask(problem, learner, sectors, True, rng, wrong)
                deque(islice(queries, plan.noise_queries), maxlen=0)
            noisy[name].append(problem.performance(learner.policy))
    result |= {f"noise/{name}": np.array(values) for name, values in noisy.items()}
    return result
