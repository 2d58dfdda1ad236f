"""Active FA-MLIRL, thesis Algorithm 4.1: learn, ask for what is least certain, learn again."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np

from irl.active_state import ActiveFiles, ActiveState, QueryRecord, identity
from irl.advice import AVOID_MODES, PREFER_MODES, Advice
from irl.choices import Limits, Settings, check_choice
from irl.clusters import with_intersections
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.demonstrators import Expert
from irl.errors import InputError
from irl.function_approx import Learner
from irl.policy_update import POLICY_UPDATES, planned_values
from irl.preferences import StatePreferences
from irl.problem import LearningProblem
from irl.queries import (
    CLUSTER_STRATEGIES,
    COMMITTEE_STRATEGIES,
    STATE_STRATEGIES,
    QueryContext,
    candidate_states,
    select_cluster,
    select_states,
)
from irl.teacher import Teacher
from irl.training import TrainingConfig
from irl.vr_function import DEVICES, WIDEST, VRFunction, torch_generator


@dataclass(frozen=True)
class ActiveConfig(Settings):
    """Algorithm 4.1's choices; each part can be switched off by itself."""

    initial: TrainingConfig = field(default_factory=lambda: TrainingConfig(iterations=10_000))
    """How the network is trained on the initial demonstrations."""
    refine: TrainingConfig = field(default_factory=lambda: TrainingConfig(iterations=100))
    """How it is trained after each round of queries, starting from the weights at hand."""
    budget: Annotated[int, Limits(0, 1_000_000_000)] = 100
    """How many state queries are asked at most."""
    batch: Annotated[int, Limits(1, 1_000_000_000)] = 1
    """How many state queries are asked in a round, and as many cluster queries; 1 in the thesis."""
    max_demonstrated: Annotated[int | None, Limits(1, 1_000_000_000)] = None
    """How many distinct states may have labels, never exceeded; None leaves it to the budget."""
    state_query: str = "masked_entropy"
    """Which state to ask about: a name in irl.queries.STATE_STRATEGIES."""
    cluster_query: str = "masked_entropy"
    """Which cluster to ask about: a name in irl.queries.CLUSTER_STRATEGIES, or none."""
    query_beta: Annotated[float, Limits(0, 1e9, open_low=True)] = 1.0
    """The inverse temperature of (4.2) in the queries; 1 in the thesis."""
    committee: Annotated[int, Limits(2, 1000)] = 5
    """How many members the committee has, where a strategy needs one.
    Each costs as much training as the main network."""
    cluster_intersections: Annotated[int, Limits(0, 100)] = 0
    """How many rounds of intersecting clusters make new ones to ask about; 0 makes none."""
    smallest_intersection: Annotated[int, Limits(1, 1_000_000_000)] = 1
    """How few states such a new cluster may have."""
    state_preferences: bool = True
    """Whether preferred and avoided states change the learnt values."""
    action_advice: bool = True
    """Whether the expert is asked."""
    avoid: str = "mask"
    """What happens to avoided actions: mask excludes them, thesis lowers their value."""
    prefer: str = "ignore"
    """What happens to preferred actions: nothing with ignore; with thesis they gain 20 % of |Q|,
    which can break a policy that is good without."""
    policy_update: str = "greedy"
    """How values become a policy: greedy takes them as they are, as the thesis does; planned plans
    anew, so that the policy settles only where demonstrations ended (irl.policy_update)."""
    hidden: Annotated[tuple[int, ...], Limits(1, WIDEST)] = (150, 50)
    """The widths of the network's hidden layers."""
    device: str = "cpu"
    """Where the networks live: cpu, or cuda for large problems on a GPU."""

    def __post_init__(self) -> None:
        """Refuse values outside their range.

        Raises:
            InputError: naming the field and what it may be.
        """
        super().__post_init__()
        check_choice("state_query", self.state_query, STATE_STRATEGIES)
        check_choice("cluster_query", self.cluster_query, (*CLUSTER_STRATEGIES, "none"))
        check_choice("avoid", self.avoid, AVOID_MODES)
        check_choice("prefer", self.prefer, PREFER_MODES)
        check_choice("policy_update", self.policy_update, POLICY_UPDATES)
        check_choice("device", self.device, DEVICES)


@dataclass(frozen=True)
class Progress:
    """What a callback is told: after each iteration, and once more, with q, when it is learnt.

    Attributes:
        query: 0 for the initial training, k for the one after the k-th answer; with a batch, k
            grows by its size.
        iteration: iterations done in this training.
        iterations: the most it will take.
        log_likelihood: mean log-likelihood of the demonstrations.
        labels: the demonstrations so far.
        q: the advised action values when this training is over, else None.
    """

    query: int
    iteration: int
    iterations: int
    log_likelihood: float
    labels: Demonstrations
    q: np.ndarray | None = None


@dataclass(frozen=True)
class Result:
    """What the algorithm learnt.

    Attributes:
        q: float64 ``[n_states, n_actions]``, advice included, −∞ where excluded; the policy is
            its argmax (PolicyUpdate).
        f: float64 ``[n_states]``, state preferences included; what ``q`` follows from, at once or
            by planning anew.
        beta: the inverse temperature at the end.
        caution: the dislike of uncertain outcomes at the end.
        network: the VR function.
        demonstrations: all labels at the end.
        advice: all advice at the end.
        history: one record a query.
    """

    q: np.ndarray
    f: np.ndarray
    beta: float
    caution: float
    network: VRFunction
    demonstrations: Demonstrations
    advice: Advice
    history: list[QueryRecord]


def active_fa_mlirl(
    problem: LearningProblem,
    demonstrations: Demonstrations,
    teacher: Teacher,
    config: ActiveConfig | None = None,
    *,
    rng: np.random.Generator,
    callback: Callable[[Progress], None] | None = None,
    checkpoint: Path | None = None,
) -> Result:
    """Run Algorithm 4.1 from the initial demonstrations to the final action values.

    No state and no cluster is asked about twice. An expert may answer about another cluster than
    it was asked for, or an intersection; that then joins the clusters (§5.11). With a batch,
    every question about states is chosen before the first is answered. The loop ends early when
    no state is left to ask about or ``config.max_demonstrated`` is reached.

    Args:
        problem: what is known beforehand, with features; its discount factor is used by the
            Bellman penalty and by a policy update that plans.
        demonstrations: D₀.
        teacher: answers questions; without an expert there is no advice.
        config: every choice; the thesis' by default.
        rng: the only source of chance, the network's initialisation included.
        callback: told of every iteration and every learnt policy.
        checkpoint: a file to save the state of affairs to after each training, with files of the
            same name and a suffix while a training goes on. If it exists, the run goes on from
            there, to the same bits as without interruption; earlier progress is not told again.

    Raises:
        InputError: if the problem has no features, a demonstration or an answer is invalid, D₀
            labels more states than ``config.max_demonstrated``, or a checkpoint is damaged or
            comes from a run with other settings or data.
        OSError: if a checkpoint cannot be written.
    """
    config = config or ActiveConfig()
    problem = replace(problem, features=problem.required_features(np.float32))
    if not config.state_preferences:
        problem = replace(problem, preferences=StatePreferences())
    if not config.action_advice or config.cluster_query == "none":
        teacher = replace(teacher, expert=None)
    demonstrations.check(problem.model, "demonstrations")
    most, labelled = config.max_demonstrated, demonstrations.n_states_demonstrated
    if most is not None and labelled > most:
        raise InputError(
            f"max_demonstrated: {most} is below the {labelled} states that the initial "
            "demonstrations label"
        )
    state = _begin(problem, demonstrations, teacher, config, rng)
    files = ActiveFiles(checkpoint, identity(state, problem, config))
    run = _Run(problem, teacher, config, state, callback, files)
    q = run.first_training()
    while (left := config.budget - len(state.history)) > 0 and not state.is_full(most):
        context = run.look_around(q)
        answered = run.ask(context, min(config.batch, left))
        if not answered:
            break
        q = run.train(config.refine, query=len(state.history) + len(answered))
        state.history += [QueryRecord(*answer, beta=state.learner.beta) for answer in answered]
        run.files.save(state)
    return Result(
        q=q,
        f=problem.preferences.apply(state.learner.values()),
        beta=state.learner.beta,
        caution=state.learner.caution or 0.0,
        network=state.learner.network,
        demonstrations=state.labels,
        advice=state.advice,
        history=state.history,
    )


def _begin(
    problem: LearningProblem,
    labels: Demonstrations,
    teacher: Teacher,
    config: ActiveConfig,
    rng: np.random.Generator,
) -> ActiveState:
    """The state of affairs before any training."""
    start = config.initial.beta, config.initial.learn_beta or config.refine.learn_beta
    committee = None
    strategies = {config.state_query} | (
        {config.cluster_query} if teacher.expert is not None else set()
    )
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


@dataclass(frozen=True)
class _Run:
    """One run of Algorithm 4.1: what stays, and the state that changes from round to round."""

    problem: LearningProblem
    teacher: Teacher
    config: ActiveConfig
    state: ActiveState
    callback: Callable[[Progress], None] | None
    files: ActiveFiles

    def first_training(self) -> np.ndarray:
        """Learn from D₀, or take up what an interrupted run saved; the action values."""
        if self.files.restore(self.state):
            return self._update_q(self.state.learner)
        q = self.train(self.config.initial, query=0)
        self.files.save(self.state)
        return q

    def train(self, training: TrainingConfig, query: int) -> np.ndarray:
        """FunctionApprox and UpdateQ: fit the network to all labels; the action values."""
        state, n = self.state, training.iterations
        labels, tell = state.labels, self.callback or (lambda progress: None)
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

    def look_around(self, q: np.ndarray) -> QueryContext:
        """What the next questions are chosen by, ``q`` being the present action values."""
        problem, config, state = self.problem, self.config, self.state
        committee_q = None
        if state.committee is not None:
            query = len(state.history)
            training = config.refine if query else config.initial
            checkpoints = [self.files.training(query, k) for k in range(config.committee)]
            state.committee.fit(state.labels, training, checkpoints)
            committee_q = np.stack([self._update_q(each) for each in state.committee.members])
        asked = np.array(state.asked, dtype=np.int64)
        known = np.r_[state.labels.state, asked]
        return QueryContext(
            model=problem.model,
            q=q,
            features=problem.required_features(np.float32),
            demonstrated=np.unique(state.labels.state),
            candidates=candidate_states(problem.model, known, problem.candidates),
            beta=config.query_beta,
            start_states=problem.start_states,
            rng=state.rng,
            committee_q=committee_q,
            ends=self._ends(),
            asked=len(state.asked),
        )

    def ask(self, context: QueryContext, number: int) -> list[tuple[int, str | None, int]]:
        """Ask about ``number`` states at most, and as many clusters; learn of the answers.

        Returns:
            For each question the state, the cluster advised, and the labelled states thereafter.
        """
        config, state, most = self.config, self.state, self.config.max_demonstrated
        answered: list[tuple[int, str | None, int]] = []
        for query in select_states(config.state_query, context, number).tolist():
            if state.is_full(most):
                break
            state.asked.append(query)
            shown = Demonstrations.from_pairs(
                self.teacher.demonstrator.trajectory(query, state.rng),
                trajectory=int(state.labels.trajectory.max()) + 1,
            )
            shown.check(self.problem.model, f"answer about state {query}")
            state.learn_of(self.teacher.generalise(shown), most)
            cluster = None
            if self.teacher.expert is not None:
                cluster = _consult(self.teacher.expert, config.cluster_query, context, state)
            answered.append((query, cluster, state.labels.n_states_demonstrated))
        return answered

    def _ends(self) -> np.ndarray:
        """Where demonstrators ended, or were asked and showed nothing: int64."""
        state = self.state
        silent = np.setdiff1d(np.array(state.asked, dtype=np.int64), state.labels.state)
        return np.union1d(state.labels.ended_in(self.problem.model), silent)

    def _update_q(self, learner: Learner) -> np.ndarray:
        model, caution = self.problem.model, learner.caution or 0.0
        f = self.problem.preferences.apply(learner.values())
        q = self._advised(model.q_values(f, caution))
        if self.config.policy_update == "greedy":
            return q
        excluded = np.isneginf(q)
        ends = self._ends()
        f = planned_values(model, f, self.problem.gamma, ends, caution=caution, excluded=excluded)
        return self._advised(model.q_values(f, caution))

    def _advised(self, q: np.ndarray) -> np.ndarray:
        config, mask = self.config, self.problem.model.mask
        return self.state.advice.apply(q, mask, config.avoid, config.prefer)


def _consult(
    expert: Expert, strategy: str, context: QueryContext, state: ActiveState
) -> str | None:
    """Ask ``expert`` about a cluster, if one is left; note the advice and return its cluster."""
    asked = select_cluster(strategy, context, state.clusters, state.asked_clusters)
    if asked is None:
        return None
    answer = expert.advise(asked, state.clusters[asked])
    state.speak_of(asked)
    cluster = asked if answer.cluster is None else answer.cluster
    if cluster != asked:
        state.speak_of(cluster)
    state.advice = state.advice.add(state.clusters[cluster], answer.preferred, answer.avoided)
    return cluster
