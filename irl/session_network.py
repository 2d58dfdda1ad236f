"""Algorithm 4.1 itself, led from outside: a VR network, questions by a strategy, advice."""

from collections.abc import Callable

import numpy as np

from irl.active_config import ActiveConfig, Progress
from irl.active_state import ActiveFiles, ActiveState, QueryRecord
from irl.advice import Advice
from irl.cluster_queries import select_cluster
from irl.clusters import with_intersections
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.function_approx import Learner
from irl.lesson_events import Advised
from irl.policy import Policy
from irl.policy_update import PolicyUpdate
from irl.problem import LearningProblem
from irl.queries import (
    COMMITTEE_STRATEGIES,
    STATE_STRATEGIES,
    QueryContext,
    candidate_states,
    select_states,
)
from irl.session import Question, Session
from irl.training_config import TrainingConfig
from irl.uncertainty import action_probabilities, entropy
from irl.vr_function import VRFunction, torch_generator


class NetworkSession(Session):
    """A session whose learner is ``fa_mlirl``; its state is that of Algorithm 4.1.

    Attributes:
        state: network, labels and advice.
        config: every choice; its budget is the caller's to keep.
        files: where it is saved after each training.
    """

    method = "fa_mlirl"
    state: ActiveState

    def __init__(
        self,
        problem: LearningProblem,
        state: ActiveState,
        config: ActiveConfig,
        generalise: Callable[[Demonstrations], Demonstrations],
        *,
        source: str = "human",
        files: ActiveFiles | None = None,
    ) -> None:
        """Nothing was said yet.

        Args:
            problem: with features.
            state: before any training, see `begin`.
            config: every choice.
            generalise: adds to a run what follows from it.
            source: who shows.
            files: where to save after each training, and to take up what is there.
        """
        super().__init__(problem, state, generalise, source=source, most=config.max_demonstrated)
        self.config, self.files = config, files or ActiveFiles(None, {})
        self._context: QueryContext | None = None
        self._answered: list[tuple[int, str | None, int]] = []

    # --- Learning ---------------------------------------------------------------------------

    def _refit(self, callback: Callable[[Progress], None] | None) -> None:
        state, config = self.state, self.config
        if not self.rounds:
            if self.files.restore(state):
                self._remember()
                self.q = self._update_q(state.learner)
                return
            self.q = self._train(config.initial, len(state.history), callback)
        else:
            answered, self._answered = self._answered, []
            self.q = self._train(config.refine, len(state.history) + len(answered), callback)
            state.history += [QueryRecord(*each, beta=state.learner.beta) for each in answered]
        self.files.save(state)

    def _train(
        self,
        training: TrainingConfig,
        query: int,
        callback: Callable[[Progress], None] | None,
    ) -> np.ndarray:
        """FunctionApprox and UpdateQ: fit the network to all labels; the action values."""
        state, n = self.state, training.iterations
        labels, tell = state.labels, callback or (lambda progress: None)
        fit = state.learner.fit(
            labels,
            training,
            state.rng,
            lambda done, value: tell(Progress(query, done, n, value, labels)),
            self.files.training(query),
        )
        done = fit.log_likelihood.size
        last = float(fit.log_likelihood[-1]) if done else float("nan")
        q = self._update_q(state.learner)
        tell(Progress(query, done, n, last, labels, q))
        return q

    def _update_q(self, learner: Learner) -> np.ndarray:
        problem, config, state = self.problem, self.config, self.state
        f = problem.preferences.apply(learner.values())
        update = PolicyUpdate(
            problem.model, problem.gamma, config.policy_update, config.avoid, config.prefer
        )
        return update.q(f, learner.caution or 0.0, state.advice, state.ends(problem.model))

    # --- Asking -----------------------------------------------------------------------------

    def propose(self, n: int) -> list[Question]:
        """The next questions about states, best first; all chosen before the first is answered.

        The context that they are chosen by serves `propose_cluster` as well.
        """
        self._context = context = self._look_around()
        strategy = self.config.state_query
        chosen = select_states(strategy, context, n)
        action = Policy.from_q(self.q, self.problem.model.mask).action
        doubt = STATE_STRATEGIES["masked_entropy"](context)
        return [
            Question(int(s), strategy, float(doubt[s]), int(action[s])) for s in chosen.tolist()
        ]

    def propose_cluster(self) -> str | None:
        """The cluster to ask about next, by the context of the last `propose`; None if none is."""
        context, state = self._context, self.state
        if context is None or self.config.cluster_query == "none":
            return None
        asked = state.asked_clusters
        return select_cluster(self.config.cluster_query, context, state.clusters, asked)

    def _look_around(self) -> QueryContext:
        """What the next questions are chosen by."""
        problem, config, state = self.problem, self.config, self.state
        committee_q = None
        if state.committee is not None:
            query = len(state.history)
            training = config.refine if query else config.initial
            checkpoints = [self.files.training(query, k) for k in range(config.committee)]
            state.committee.fit(state.labels, training, checkpoints)
            committee_q = np.stack([self._update_q(each) for each in state.committee.members])
        return QueryContext(
            model=problem.model,
            q=self.q,
            features=problem.required_features(np.float32),
            demonstrated=np.unique(state.labels.state),
            candidates=candidate_states(problem.model, self.known, problem.candidates),
            beta=config.query_beta,
            start_states=problem.start_states,
            rng=state.rng,
            committee_q=committee_q,
            ends=state.ends(problem.model),
            asked=len(state.asked),
        )

    def sure(self, states: np.ndarray) -> np.ndarray:
        """The policy's own probability of its action, at the network's β."""
        return action_probabilities(self.q[states], self.state.learner.beta).max(axis=1)

    def gain(self, states: np.ndarray) -> np.ndarray:
        """The entropy of its choice there, (4.1)."""
        return entropy(self.q[states], self.config.query_beta)

    # --- What was said ----------------------------------------------------------------------

    def _learn(self, number: int) -> None:
        new = number not in self._learnt
        super()._learn(number)
        if new:
            demonstrated = self.state.labels.n_states_demonstrated
            self._answered.append((self.state.asked[-1], None, demonstrated))

    def _add(self, run: Demonstrations) -> None:
        # That a question was answered with nothing to show, ``asked`` says.
        if len(run):
            super()._add(run)

    def _advise(self, event: Advised) -> None:
        super()._advise(event)
        if self._answered:
            state, _, demonstrated = self._answered[-1]
            self._answered[-1] = (state, event.cluster, demonstrated)


def begin(
    problem: LearningProblem,
    labels: Demonstrations,
    config: ActiveConfig,
    rng: np.random.Generator,
    *,
    advised: bool = True,
) -> ActiveState:
    """The state of affairs before any training.

    Args:
        problem: with features.
        labels: the demonstrations that come first.
        config: every choice.
        rng: draws networks, and later what the run draws.
        advised: whether clusters will be asked about.
    """
    start = config.initial.beta, config.initial.learn_beta or config.refine.learn_beta
    committee = None
    strategies = {config.state_query} | ({config.cluster_query} if advised else set())
    if COMMITTEE_STRATEGIES & strategies:
        # Its own stream: the main network learns the same whether there is a committee or not.
        own_rng = rng.spawn(1)[0]
        committee = Committee(
            problem, config.committee, config.hidden, own_rng, *start, device=config.device
        )
    network = VRFunction(
        problem.required_features().shape[1],
        config.hidden,
        generator=torch_generator(rng),
        device=config.device,
    )
    return ActiveState(
        learner=Learner(problem, network, *start),
        committee=committee,
        labels=labels,
        advice=Advice.none(problem.model.n_states, problem.model.n_actions),
        clusters=with_intersections(
            problem.clusters, config.cluster_intersections, config.smallest_intersection
        ),
        rng=rng,
    )
