"""A posterior over hypotheses: goals × sizes of costs, proposed, planned for, and weighed.

Nobody can plan for every combination. Proposals come from three sources: every goal without costs,
combinations drawn from the prior, and neighbours of what explains the labels well so far: one cost
a step larger or smaller, or the goal another. What was planned for once is kept, and weighed anew
as labels come in.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import logsumexp

from irl.demonstrations import Demonstrations
from irl.posterior.evidence import BETAS, EPSILONS, Evidence
from irl.posterior.goals import Goal
from irl.posterior.plans import HardPlans
from irl.posterior.shares import stands_for

SIZES = np.array([0.0, *(0.01 * 2 ** (np.arange(13) / 2))])
"""Sizes that a cost may have, where a goal is worth 1. Twice as coarse, the nearest would still get
up to 4 % of the choices wrong."""
BATCH = 64
"""Hypotheses planned for together."""
_FREE = 0.5  # prior probability that a cost does not matter
LOG_PRIOR = np.where(SIZES == 0, np.log(_FREE), np.log1p(-_FREE) - np.log(SIZES.size - 1))
"""Logarithm of the prior probability of every one of ``SIZES``."""
_FLATTER = 0.3  # power of the posterior that neighbours are sought by, for half of them
_AT_ONCE = 2**23  # action values weighed together: 64 MiB
_KEPT = 64  # hypotheses that predictions are made with, at most


class Belief:
    """What is believed of goal and costs.

    Attributes:
        plans: the planner.
        names: of the costs that are weighed, ``[n_costs]``.
        step_cost: what every action costs.
        goals: every goal proposed.
        goal: index into ``goals`` of every hypothesis, int64 ``[n]``.
        level: index into ``SIZES`` of every cost, int64 ``[n, n_costs]``.
        f: VR values of every hypothesis, float32 ``[n_states, n]``.
        log_likelihood: ``[n, betas, epsilons]``.
    """

    def __init__(self, plans: HardPlans, names: Sequence[str], step_cost: float) -> None:
        """Nothing is believed yet; the planner's costs are those of ``names``, and 1 a step."""
        self.plans, self.names, self.step_cost = plans, list(names), step_cost
        n_states = plans.model.n_states
        self.goals: list[Goal] = []
        self.goal = np.zeros(0, dtype=np.int64)
        self.level = np.zeros((0, len(self.names)), dtype=np.int64)
        self.f = np.zeros((n_states, 0), dtype=np.float32)
        self.log_likelihood = np.zeros((0, BETAS.size, EPSILONS.size))
        self.evidence = self._prepared(Demonstrations.empty())
        self._stands_for = np.ones(0)
        self._known: set[bytes] = set()
        self._goal_keys: dict[bytes, int] = {}

    # --- Hypotheses -------------------------------------------------------------------------

    def sizes(self, level: np.ndarray) -> np.ndarray:
        """Sizes of all the planner's costs, ``[n_costs + 1, n]``."""
        return np.vstack([SIZES[level].T, np.full(len(level), self.step_cost)])

    def members(self, goal: np.ndarray) -> np.ndarray:
        """The goals' states, bool ``[n_states, n]``."""
        if not len(goal):
            return np.zeros((self.plans.model.n_states, 0), dtype=bool)
        return np.stack([self.goals[g].member for g in goal], axis=1)

    def propose(self, goals: Sequence[Goal]) -> None:
        """Add goals, each without costs."""
        new = [goal for goal in goals if goal.key not in self._goal_keys]
        for goal in new:
            self._goal_keys[goal.key] = len(self.goals)
            self.goals.append(goal)
        first = len(self.goals) - len(new)
        index = np.arange(first, len(self.goals))
        self.add(index, np.zeros((index.size, len(self.names)), dtype=np.int64))

    def add(self, goal: np.ndarray, level: np.ndarray) -> None:
        """Plan for hypotheses that are new."""
        fresh = []
        for k, key in enumerate(np.column_stack([goal, level])):
            if key.tobytes() not in self._known:
                self._known.add(key.tobytes())
                fresh.append(k)
        if not fresh:
            return
        goal, level = goal[fresh], level[fresh]
        f = self.plans.vr_values(self.members(goal), self.sizes(level))
        self.goal = np.concatenate([self.goal, goal])
        self.level = np.concatenate([self.level, level])
        self.f = np.concatenate([self.f, f], axis=1)
        said = self._weigh(goal, level, f)
        self.log_likelihood = np.concatenate([self.log_likelihood, said])
        self._stands_for = stands_for(self.goal, self.level, SIZES.size - 1)

    def _weigh(self, goal: np.ndarray, level: np.ndarray, f: np.ndarray) -> np.ndarray:
        pairs, said = self.evidence.pairs, []
        few = max(1, _AT_ONCE // max(pairs.size, 1))
        for k in range(0, len(goal), few):
            q = self.plans.q(f[:, k : k + few], self.sizes(level[k : k + few]), pairs)
            member = self.members(goal[k : k + few])
            said.append(self.evidence.log_likelihood(q.astype(np.float64), member))
        return np.concatenate(said) if said else self.log_likelihood[:0]

    def _prepared(
        self, demonstrations: Demonstrations, proposals: Mapping[int, int] | None = None
    ) -> Evidence:
        # The last cost is that of every step.
        costs = self.plans.costs[:, :-1]
        return Evidence.of(self.plans.model, demonstrations, costs, proposals)

    def observe(
        self, demonstrations: Demonstrations, proposals: Mapping[int, int] | None = None
    ) -> None:
        """Weigh all hypotheses by these demonstrations, in place of the former.

        Args:
            demonstrations: all there are.
            proposals: what some of them answer (`irl.posterior.verdicts`).
        """
        self.evidence = self._prepared(demonstrations, proposals)
        self.log_likelihood = self._weigh(self.goal, self.level, self.f)

    def explore(self, rounds: int, rng: np.random.Generator) -> None:
        """Plan for more: in each round neighbours of the likely, and a few from the prior."""
        for _ in range(rounds):
            weight = self.weight
            # Half of them from a flatter distribution: the truth may look unlikely from afar.
            flat = weight**_FLATTER / (weight**_FLATTER).sum()
            parents = rng.choice(weight.size, BATCH, p=(weight + flat) / 2)
            goal, level = self.goal[parents], self.level[parents].copy()
            for k in range(BATCH):
                kind = rng.random()
                if kind < 0.2:
                    goal[k] = rng.integers(len(self.goals))
                elif kind < 0.4 and self.names:
                    drawn = rng.integers(1, SIZES.size, len(self.names))
                    level[k] = np.where(rng.random(len(self.names)) < _FREE, 0, drawn)
                elif self.names:
                    for _ in range(1 + (rng.random() < 0.3)):
                        c = rng.integers(len(self.names))
                        level[k, c] = _step(level[k, c], rng)
            self.add(goal, level)

    # --- What is believed -------------------------------------------------------------------

    @property
    def _joint(self) -> np.ndarray:
        """Logarithm of prior times likelihood, ``[n, betas, epsilons]``."""
        prior = LOG_PRIOR[self.level].sum(axis=1) + np.log(self._stands_for)
        return self.log_likelihood + prior[:, None, None]

    @property
    def weight(self) -> np.ndarray:
        """Posterior of every hypothesis, float64 ``[n]``."""
        each = logsumexp(self._joint, axis=(1, 2))
        return np.exp(each - logsumexp(each))

    @property
    def care(self) -> np.ndarray:
        """Posterior of every β and ε, float64 ``[betas, epsilons]``."""
        joint = self._joint
        return np.exp(logsumexp(joint, axis=0) - logsumexp(joint))

    def likely(self, most: int = _KEPT) -> tuple[np.ndarray, np.ndarray]:
        """The likeliest hypotheses, their indices and their weights, which sum to 1."""
        weight = self.weight
        order = np.argsort(-weight, kind="stable")[:most]
        order = order[weight[order] > 1e-4 * weight[order[0]]]
        return order, weight[order] / weight[order].sum()

    def sample(self, rng: np.random.Generator) -> tuple[Goal, Mapping[str, float]]:
        """A goal and sizes of costs, drawn from the posterior."""
        k = int(rng.choice(self.goal.size, p=self.weight))
        return self.describe(k)

    def describe(self, k: int) -> tuple[Goal, Mapping[str, float]]:
        """Goal and sizes of costs of one hypothesis."""
        sizes = SIZES[self.level[k]].tolist()
        return self.goals[self.goal[k]], dict(zip(self.names, sizes, strict=True))

    def values_of(self, chosen: np.ndarray, pairs: np.ndarray | None = None) -> np.ndarray:
        """Action values of pairs under some hypotheses, float32 ``[pairs, n]``."""
        return self.plans.q(self.f[:, chosen], self.sizes(self.level[chosen]), pairs)


def _step(level: int, rng: np.random.Generator) -> int:
    """The size next to this one, or none, or from none any."""
    if level == 0:
        return int(rng.integers(1, SIZES.size))
    if rng.random() < 0.2:
        return 0
    return int(np.clip(level + rng.choice([-2, -1, 1, 2]), 1, SIZES.size - 1))
