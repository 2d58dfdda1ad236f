"""The learner: proposals from what was shown, a belief, a question, and the policy that follows."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Annotated

import numpy as np

from irl.baselines.sparse_planning import SparseConfig, sparse_planning
from irl.choices import Limits, Settings
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.method_inputs import walk_ends, walks
from irl.policy import Policy
from irl.posterior.arriving import SHORT, arriving
from irl.posterior.audit import Audit
from irl.posterior.audit_states import audit_parts
from irl.posterior.belief import Belief
from irl.posterior.evidence import EPSILONS
from irl.posterior.goals import beyond, propose
from irl.posterior.plans import HardPlans
from irl.posterior.predictions import (
    Predicted,
    action_values,
    ends_agree,
    predict,
    predicted_success,
)
from irl.posterior.questions import most_telling
from irl.problem import LearningProblem

SURPRISE = "surprise"
"""The cost that every transition model lends: 1 − max P, how uncertain an outcome is."""
SURE = 0.99
"""Predicted success from which values need not be made surer."""
AGREE = 0.05
"""Least probability of ending where a demonstration did, below which the goal is not found."""
SAME = 0.0025
"""Actions whose mean values differ by less are proposed in an audit alike; a quarter of a step."""
_AS_LIKELY = 0.01  # by how much less likely than any a goal may be that is gone to surely
_MOST_ENDS, _MOST_REWARDED = 8, 6  # states that goals are proposed around
_JUDGED = 2000  # states that predicted accuracy is taken over, at most
_PAYS = 0.1  # share of the largest reward below which a state is not proposed


@dataclass(frozen=True)
class GoalConfig(Settings):
    """How long hypotheses are sought, and what is taken as known."""

    rounds: Annotated[int, Limits(0, 1000)] = 8
    """Batches of 64 hypotheses that are planned for after the goals alone."""
    step_cost: Annotated[float, Limits(0, 1)] = 0.01
    """What every action is known to cost, where a goal is worth 1."""


class GoalLearner:
    """Learns goal and costs from what it is shown, and knows what to ask.

    Attributes:
        problem: what is known beforehand; its ``costs`` and ``factors`` shape the hypotheses.
        shown: all demonstrations so far.
        belief: what is believed after them.
        held_out: answers of the audit, from which nothing was learnt yet.
        audit: what they said of the predictions.
        mistaken: audits that contradicted.
        proposals: in an audit, the actions proposed, by the number of the run that an answer is.
        skipped: states that the demonstrator does not want to be asked about, int64.
    """

    def __init__(
        self,
        problem: LearningProblem,
        *,
        rng: np.random.Generator,
        config: GoalConfig | None = None,
    ) -> None:
        """Nothing was shown yet.

        Args:
            problem: what is known beforehand.
            rng: draws hypotheses and candidates for questions.
            config: how long to seek, and what an action costs.
        """
        self.problem, self._rng, self._config = problem, rng, config or GoalConfig()
        model = problem.model
        named = {SURPRISE: model.surprise, **problem.costs}
        # A cost that is the same for all that can be done in each state is none.
        kept = {name: cost for name, cost in named.items() if np.ptp(cost) > 0}
        table = np.column_stack([*kept.values(), np.ones(model.n_pairs)])
        plans = HardPlans(model, problem.gamma, table, problem.fixed_vr)
        self.belief = Belief(plans, list(kept), self._config.step_cost)
        self.shown = self.held_out = Demonstrations.empty()
        self.audit, self.mistaken = Audit(), 0
        self.proposals: dict[int, int] = {}
        self.skipped = np.zeros(0, dtype=np.int64)
        self._proposed: dict[int, int] = {}

    def learn(self, shown: Demonstrations, rounds: int | None = None) -> None:
        """Take up all demonstrations there are, in place of the former, and seek hypotheses.

        Args:
            shown: labels, and where runs ended if that is known.
            rounds: batches of hypotheses to plan for; the configuration's if None.

        Raises:
            InputError: if there is no demonstration, or one cannot be.
        """
        if not len(shown) and not len(shown.ends):
            raise InputError("at least one pair, or one run's end, wanted", place="demonstrations")
        shown.check(self.problem.model, "demonstrations")
        for name in ("_acting", "action", "predicted", "ends_agree"):
            self.__dict__.pop(name, None)
        known, self.shown = set(self.shown.ends[:, 2].tolist()), shown
        self.belief.observe(shown, self.proposals)
        if not self.belief.goals or known != set(shown.ends[:, 2].tolist()):
            self._propose()
        self.belief.explore(self._config.rounds if rounds is None else rounds, self._rng)

    def _propose(self) -> None:
        """Goals around the states where runs ended; if none did, where rewards would explain them.

        Where nobody says that a run ended, it may have been cut off.
        """
        model, shown = self.problem.model, self.shown
        states, count = np.unique(shown.ends[:, 2], return_counts=True)
        ends, rewarded = states[np.argsort(-count, kind="stable")], np.zeros(0, dtype=np.int64)
        if not ends.size:
            ends = walk_ends(model, walks(shown))
            every = SparseConfig(prune=False)
            reward, _ = sparse_planning(model, shown, gamma=self.problem.gamma, config=every)
            order = np.argsort(-reward, kind="stable")[:_MOST_REWARDED]
            rewarded = order[reward[order] > _PAYS * max(reward.max(), 0.0)]
        goals = propose(ends[:_MOST_ENDS], rewarded, self.problem.factors, model.n_states)
        self.belief.propose(goals)

    @property
    def q(self) -> np.ndarray:
        """Action values, float64 ``[n_states, n_actions]``; −∞ where infeasible.

        Means of the posterior. In states from which acting by these would not arrive, what actions
        cost counts for less, by as little as does (`irl.posterior.arriving`). As long as they are
        not `SURE` to reach the goal, and a plan to the surest goals is likelier to, that plan's: a
        run's end is in every region that it may stand for.
        """
        return self._acting[0]

    @property
    def arrived(self) -> np.ndarray:
        """The states that it takes for a goal, where it stops; bool ``[n_states]``.

        Those that are likelier than not one, or if it is not sure, as likely as any.
        """
        return self._acting[1]

    @cached_property
    def _acting(self) -> tuple[np.ndarray, np.ndarray]:
        """Action values, and where they stop."""
        model, starts, goal = self.problem.model, self.problem.start_states, self._goal_odds

        def success(q: np.ndarray) -> float:
            return predicted_success(self.belief, Policy.from_q(q, model.mask).action, starts)

        likely = goal > 1 / 2
        values = partial(action_values, self.belief)
        q = arriving(values, model, np.flatnonzero(likely), starts)
        expected = success(q)
        if expected >= SURE:
            return q, likely
        core = goal >= goal.max() - _AS_LIKELY
        surest = arriving(partial(self._to, core), model, np.flatnonzero(core), starts)
        return (surest, core) if success(surest) > expected + SHORT else (q, likely)

    def _to(self, goal: np.ndarray, leaning: float) -> np.ndarray:
        """Action values of a plan to ``goal``, bool ``[n_states]``, with mean sizes of costs."""
        belief = self.belief
        chosen, weight = belief.likely()
        sizes = (belief.sizes(belief.level[chosen]) @ weight)[:, None] / (1.0 + leaning)
        f = belief.plans.vr_values(goal[:, None], sizes)
        return self.problem.model.table(belief.plans.q(f, sizes)[:, 0].astype(np.float64))

    @property
    def _goal_odds(self) -> np.ndarray:
        """Probability that each state is a goal, ``[n_states]``."""
        chosen, weight = self.belief.likely()
        return self.belief.members(self.belief.goal[chosen]) @ weight

    @property
    def reward(self) -> np.ndarray:
        """Probability that each state is a goal, less what is known to be lost there.

        float64 ``[n_states]``. Costs are of pairs, and not in it.
        """
        return self._goal_odds + self.belief.plans.value

    @cached_property
    def action(self) -> np.ndarray:
        """The policy: the best action by the mean values, int64 ``[n_states]``; −1 for none."""
        return Policy.from_q(self.q, self.problem.model.mask).action

    @cached_property
    def predicted(self) -> Predicted:
        """How well the policy is going to do, if the truth is among the hypotheses."""
        judged, action = self.candidates, self.action
        judged = judged[action[judged] >= 0]
        if judged.size > _JUDGED:
            judged = np.random.default_rng(0).choice(judged, _JUDGED, replace=False)
        return predict(self.belief, action, self.problem.start_states, judged)

    @cached_property
    def ends_agree(self) -> float:
        """The least probability, over runs whose end is known, that its plan ends there too."""
        shown = self.shown
        last = {run: (int(step), int(state)) for run, step, state in shown.ends}
        first: dict[int, tuple[int, int]] = {}
        for run, step, state in zip(shown.trajectory, shown.step, shown.state, strict=True):
            if run in last and (run not in first or step < first[run][0]):
                first[run] = (int(step), int(state))
        runs = [(first[run][1] if run in first else end, end) for run, (_, end) in last.items()]
        return ends_agree(self.belief, self.problem.model, runs)

    @property
    def unexplained(self) -> float:
        """Share of labels that the belief takes for slips: the posterior mean of ε."""
        return float(self.belief.care.sum(axis=0) @ EPSILONS)

    @property
    def candidates(self) -> np.ndarray:
        """The states that may be asked about and where something can be done, int64."""
        model, candidates = self.problem.model, self.problem.candidates
        return model.acting if candidates is None else np.intersect1d(candidates, model.acting)

    def question(self) -> int:
        """The state to ask about next: not one that was labelled or where a run ended.

        Raises:
            InputError: if there is none left.
        """
        return most_telling(self.belief, self.unasked, self._rng)

    @property
    def untried_goal(self) -> int | None:
        """A state to ask about since it is taken for a goal, and is not just where runs ended.

        None if there is none (`irl.posterior.goals.beyond`).
        """
        ends = np.unique(self.shown.ends[:, 2])
        return beyond(self.belief.goals, ends, self.arrived, self._askable)

    def audit_question(self) -> int:
        """The next state of the audit: one whose answer was a surprise, again, or drawn by chance.

        From a part of the states that none was drawn from yet (`irl.posterior.audit_states`).

        What is proposed there is drawn too, from the actions that seem equally good: who minds
        something without a name minds some of them, and one choice of a policy shows less of it.

        Raises:
            InputError: as `question`.
        """
        again = self.audit.again
        if again is not None:
            return again
        left, asked = self.unasked, np.array(list(self.audit.passed), dtype=np.int64)
        states, ends = np.union1d(left, asked), np.unique(self.shown.ends[:, 2])
        action = self.action[states]
        part = audit_parts(self.problem, states, action, ends, self.audit.wanted, self.mistaken)
        covered = part[np.isin(states, asked)]
        open_ = np.unique(part[np.isin(states, left) & ~np.isin(part, covered)])
        if open_.size:
            left = np.intersect1d(left, states[part == self._rng.choice(open_)])
        state = int(self._rng.choice(left))
        value = self.q[state]
        self._proposed[state] = int(self._rng.choice(np.flatnonzero(value >= value.max() - SAME)))
        return state

    @property
    def unasked(self) -> np.ndarray:
        """The states that may be asked about: neither labelled, skipped, nor a run's end; int64.

        Raises:
            InputError: if there is none left.
        """
        left = self._askable
        if not left.size:
            raise InputError("every state that may be asked about was", place="candidates")
        return left

    @property
    def _askable(self) -> np.ndarray:
        given = Demonstrations.concatenate([self.shown, self.held_out])
        out = np.concatenate([given.state, given.ends[:, 2], self.skipped])
        return np.setdiff1d(self.candidates, out)

    def proposal(self, state: int) -> int | None:
        """What the learner would do in a state; None if it takes it for a goal."""
        return None if self.arrived[state] else self._proposed.get(state, int(self.action[state]))

    def compare(
        self, answer: Demonstrations, proposed: Mapping[int, int | None] | None = None
    ) -> None:
        """Take up the answer to a proposal in the audit: what will do there.

        That is the proposal itself if it will. It is held out until the audit is over. Then all its
        answers are learnt from, as what they say of proposals. If it contradicted, hypotheses are
        sought as long as after the first run, and another is to begin.

        Args:
            answer: one label, or that a run ended there.
            proposed: what was proposed in its state, if that is not what would be now.
        """
        self.held_out = Demonstrations.concatenate([self.held_out, answer])
        runs = [*answer.trajectory.tolist(), *answer.ends[:, 0].tolist()]
        said = [*answer.pairs, *((s, None) for s in answer.ends[:, 2].tolist())]
        for run, (state, action) in zip(runs, said, strict=True):
            at_hand = self.proposal(state) if proposed is None else proposed[state]
            if at_hand is not None:
                self.proposals[run] = at_hand
            self.audit.compare(state, at_hand == action)
        if self.audit.contradicted:
            self.mistaken += 1
            self.audit = Audit.after(self.mistaken)
        elif not self.audit.confirmed:
            return
        held_out, self.held_out = self.held_out, Demonstrations.empty()
        self._proposed.clear()
        rounds = 1 if self.audit.confirmed else None
        self.learn(Demonstrations.concatenate([self.shown, held_out]), rounds)
