"""Active FA-MLIRL, thesis Algorithm 4.1: learn, ask for what is least certain, learn again."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from irl.active_state import ActiveState, QueryRecord, identity
from irl.advice import AVOID_MODES, Advice
from irl.choices import check_choice, check_range
from irl.clusters import with_intersections
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.demonstrators import Demonstrator, Expert
from irl.errors import InputError
from irl.function_approx import Learner, Surroundings
from irl.mdp import TransitionModel
from irl.preferences import StatePreferences
from irl.queries import (
    CLUSTER_STRATEGIES,
    COMMITTEE_STRATEGIES,
    STATE_STRATEGIES,
    QueryContext,
    candidate_states,
    select_cluster,
    select_states,
)
from irl.training import TrainingConfig
from irl.vr_function import VRFunction, torch_generator


@dataclass(frozen=True)
class ActiveConfig:
    """Algorithm 4.1's choices; each part can be switched off by itself."""

    initial: TrainingConfig = field(default_factory=lambda: TrainingConfig(iterations=10_000))
    """Training on the initial demonstrations."""
    refine: TrainingConfig = field(default_factory=lambda: TrainingConfig(iterations=100))
    """Training after each round of queries, from the weights at hand."""
    budget: int = 100
    """Most state queries."""
    batch: int = 1
    """State queries a round, and cluster queries as many; 1 in the thesis."""
    max_demonstrated: int | None = None
    """Most distinct states with labels, never exceeded; none: the budget alone decides."""
    state_query: str = "masked_entropy"
    """Which state to ask about, a name in irl.queries.STATE_STRATEGIES."""
    cluster_query: str = "masked_entropy"
    """Which cluster to ask about, a name in irl.queries.CLUSTER_STRATEGIES, or none."""
    query_beta: float = 1.0
    """Inverse temperature of (4.2) in the queries; 1 in the thesis."""
    committee: int = 5
    """Members of the committee, where a strategy asks for one; each costs as much training as
    the main network."""
    cluster_intersections: int = 0
    """Rounds of intersecting clusters to make new ones that may be asked about; 0: none."""
    smallest_intersection: int = 1
    """Fewest states of such a new cluster."""
    state_preferences: bool = True
    """Whether preferred and avoided states change the learnt values."""
    action_advice: bool = True
    """Whether the expert is asked."""
    avoid: str = "mask"
    """What happens to avoided actions: mask or thesis."""
    hidden: tuple[int, ...] = (150, 50)
    """Widths of the network's hidden layers."""

    def __post_init__(self) -> None:
        """Refuse values outside their range.

        Raises:
            InputError: naming the field and what it may be.
        """
        check_choice("state_query", self.state_query, STATE_STRATEGIES)
        check_choice("cluster_query", self.cluster_query, (*CLUSTER_STRATEGIES, "none"))
        check_choice("avoid", self.avoid, AVOID_MODES)
        check_range("budget", self.budget, 0)
        check_range("batch", self.batch, 1)
        check_range("committee", self.committee, 2)
        check_range("cluster_intersections", self.cluster_intersections, 0)
        check_range("smallest_intersection", self.smallest_intersection, 1)
        check_range("query_beta", self.query_beta, 0, open_low=True)
        if self.max_demonstrated is not None:
            check_range("max_demonstrated", self.max_demonstrated, 1)


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
        f: float64 ``[n_states]``, state preferences included.
        beta: the inverse temperature at the end.
        network: the VR function.
        demonstrations: all labels at the end.
        advice: all advice at the end.
        history: one record a query.
    """

    q: np.ndarray
    f: np.ndarray
    beta: float
    network: VRFunction
    demonstrations: Demonstrations
    advice: Advice
    history: list[QueryRecord]


def active_fa_mlirl(
    *,
    model: TransitionModel,
    features: np.ndarray,
    gamma: float,
    fixed_vr: Mapping[int, float],
    demonstrations: Demonstrations,
    demonstrator: Demonstrator,
    expert: Expert | None,
    clusters: Mapping[str, np.ndarray],
    preferences: StatePreferences,
    generalise: Callable[[Demonstrations], Demonstrations],
    config: ActiveConfig,
    rng: np.random.Generator,
    callback: Callable[[Progress], None] | None = None,
    candidates: np.ndarray | None = None,
    start_states: np.ndarray | None = None,
    checkpoint: Path | None = None,
) -> Result:
    """Run Algorithm 4.1 from the initial demonstrations to the final action values.

    No state and no cluster is asked about twice. An expert may answer about another cluster than
    it was asked for, or an intersection; that then joins the clusters (§5.11). With a batch,
    every question about states is chosen before the first is answered. The loop ends early when
    no state is left to ask about or ``config.max_demonstrated`` is reached.

    Args:
        model: the transition model P.
        features: ``[n_states, n_features]``, the network's input.
        gamma: discount factor, used by the Bellman penalty alone.
        fixed_vr: state → VR value known beforehand, such as −1 for a lost object.
        demonstrations: D₀, of which one label a state is used.
        demonstrator: answers state queries with trajectories.
        expert: answers cluster queries; None switches advice off.
        clusters: name → state indices.
        preferences: preferred and avoided states.
        generalise: from a trajectory to itself and what follows from it.
        config: every choice.
        rng: the only source of chance, the network's initialisation included.
        callback: told of every iteration and every learnt policy.
        candidates: state indices that queries stay within; all if absent.
        start_states: where episodes begin; every state with a feasible action if absent.
        checkpoint: a file to save the state of affairs to after each training. If it exists,
            the run goes on from there, to the same bits as without interruption; earlier
            progress is not told again.

    Raises:
        InputError: if a demonstration or an answer is invalid, D₀ labels more states than
            ``config.max_demonstrated``, or the checkpoint is damaged or comes from a run with
            other settings or data.
        OSError: if the checkpoint cannot be written.
    """
    features = np.asarray(features, dtype=np.float32)
    labels = demonstrations.resolved()
    most = config.max_demonstrated
    if most is not None and labels.n_states_demonstrated > most:
        raise InputError(
            f"max_demonstrated: {most} is below the {labels.n_states_demonstrated} states that the "
            "initial demonstrations label"
        )
    if start_states is None:
        start_states = np.flatnonzero(np.diff(model.first_pair))
    if not config.state_preferences:
        preferences = StatePreferences()
    if not config.action_advice or config.cluster_query == "none":
        expert = None
    surroundings = Surroundings(model, features, gamma, fixed_vr)
    carry_beta = config.initial.learn_beta or config.refine.learn_beta
    committee = None
    if COMMITTEE_STRATEGIES & {config.state_query, config.cluster_query if expert else "none"}:
        # Its own stream: the main network learns the same whether there is a committee or not.
        own_rng = rng.spawn(1)[0]
        committee = Committee(
            surroundings,
            config.committee,
            config.hidden,
            own_rng,
            config.initial.beta,
            carry_beta,
        )
    state = ActiveState(
        learner=Learner(
            surroundings,
            VRFunction(features.shape[1], config.hidden, generator=torch_generator(rng)),
            config.initial.beta,
            carry_beta,
        ),
        committee=committee,
        labels=labels,
        advice=Advice.none(model.n_states, model.n_actions),
        clusters=with_intersections(
            clusters, config.cluster_intersections, config.smallest_intersection
        ),
        rng=rng,
    )
    run = identity(
        state,
        config,
        {
            "candidates": candidates,
            "start_states": start_states,
            "preferred": preferences.preferred,
            "avoided": preferences.avoided,
        },
    )

    def update_q(f: np.ndarray) -> np.ndarray:
        return state.advice.apply(model.q_values(preferences.apply(f)), model.mask, config.avoid)

    def function_approx(training: TrainingConfig, query: int) -> np.ndarray:
        tell = callback or (lambda progress: None)
        labels, n = state.labels, training.iterations
        fit = state.learner.fit(
            labels, training, rng, lambda done, value: tell(Progress(query, done, n, value, labels))
        )
        done = fit.log_likelihood.size
        last = float(fit.log_likelihood[-1]) if done else float("nan")
        q = update_q(state.learner.values())
        tell(Progress(query, done, n, last, labels, q))
        return q

    if checkpoint is not None and checkpoint.exists():
        state.restore(checkpoint, run)
        q = update_q(state.learner.values())
    else:
        q = function_approx(config.initial, query=0)
        if checkpoint is not None:
            state.save(checkpoint, run)

    while (left := config.budget - len(state.history)) > 0 and not state.is_full(most):
        committee_q = None
        if committee is not None:
            committee.fit(state.labels, config.refine if state.history else config.initial)
            committee_q = np.stack([update_q(f) for f in committee.values()])
        known = np.r_[state.labels.state, np.array(state.asked, dtype=np.int64)]
        context = QueryContext(
            model=model,
            q=q,
            features=features,
            demonstrated=state.labels.state,
            candidates=candidate_states(model, known, candidates),
            beta=config.query_beta,
            start_states=start_states,
            rng=rng,
            committee_q=committee_q,
        )
        answered: list[tuple[int, str | None, int]] = []
        for query in select_states(config.state_query, context, min(config.batch, left)).tolist():
            if state.is_full(most):
                break
            state.asked.append(query)
            shown = Demonstrations.from_pairs(
                demonstrator.trajectory(query, rng),
                trajectory=int(state.labels.trajectory.max()) + 1,
            )
            state.learn_of(generalise(shown), most)
            cluster = None
            if expert is not None:
                cluster = _consult(expert, config.cluster_query, context, state)
            answered.append((query, cluster, state.labels.n_states_demonstrated))
        if not answered:
            break
        q = function_approx(config.refine, query=len(state.history) + len(answered))
        state.history += [QueryRecord(*answer, beta=state.learner.beta) for answer in answered]
        if checkpoint is not None:
            state.save(checkpoint, run)

    learner = state.learner
    return Result(
        q=q,
        f=preferences.apply(learner.values()),
        beta=learner.beta,
        network=learner.network,
        demonstrations=state.labels,
        advice=state.advice,
        history=state.history,
    )


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
