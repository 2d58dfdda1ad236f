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

import numpy as np
from scipy.optimize import minimize

from irl.advice import Advice
from irl.collection import demonstrate, mislabel
from irl.demonstrations import Demonstrations
from irl.demonstrators import ClusterAdvice, OracleDemonstrator, OracleExpert
from irl.domains.sailing import Sailing, ideal_clusters, purity, shuffled_clusters
from irl.likelihood import LikelihoodProblem
from irl.planning import policy_success, uniform_policy
from irl.queries import entropy

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

        def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
            value, df, _ = problem.value_and_gradient(phi @ weights, 1.0)
            gradient = self._l2 * weights - labels * (phi.T @ df)
            return self._l2 / 2 * (weights @ weights) - labels * value, gradient

        answer = minimize(
            loss,
            self._weights,
            jac=True,
            method="L-BFGS-B",
            options={"gtol": 1e-3, "ftol": 1e-8, "maxiter": 200},
        )
        self._weights = answer.x
        self._learnt_q = self._lake.model.q_values(self._lake.features @ self._weights)

    def take(self, states: np.ndarray, advice: ClusterAdvice) -> None:
        """Heed one more answer about a cluster of states."""
        self._advice = self._advice.add(states, advice.preferred, advice.avoided)
        if not self._objective:
            return
        for action in sorted(advice.preferred):
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


def next_cluster(
    clusters: np.ndarray,
    asked: np.ndarray,
    uncertainty: np.ndarray | None,
    rng: np.random.Generator,
) -> int | None:
    """Whom to ask about: the cluster of highest mean uncertainty, or any.

    Args:
        clusters: cluster of each state, int64 ``[n_states]``, −1 outside. A query about a state
            is one about a cluster of its own.
        asked: clusters that have been asked about.
        uncertainty: ``[n_states]``; None draws evenly.
        rng: draws, and breaks ties.

    Returns:
        The cluster; None when all have been asked about.
    """
    open_ = np.setdiff1d(clusters[clusters >= 0], asked)
    if not open_.size:
        return None
    if uncertainty is None:
        return int(rng.choice(open_))
    inside = clusters >= 0
    total = np.bincount(clusters[inside], uncertainty[inside])[open_]
    mean = total / np.bincount(clusters[inside])[open_]
    return int(rng.choice(open_[mean == mean.max()]))


def ask(
    problem: Problem,
    learner: Learner,
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
        chosen = next_cluster(clusters, np.array(asked, int), uncertainty, rng)
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
class Plan:
    """What every seed does; see the command's Config for the fields."""

    size: int
    delay: float
    gamma: float
    demonstrations: int
    objective_queries: int
    qualities: tuple[float, ...]
    noise: tuple[float, ...]
    noise_demonstrations: int
    noise_queries: int
    prefer_share: float
    avoid_share: float
    l2: float

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
    problem: Problem, learner: Learner, queries: Iterator[int], points: np.ndarray
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
