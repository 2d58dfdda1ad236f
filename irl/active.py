"""Active FA-MLIRL, thesis Algorithm 4.1: learn, ask for what is least certain, learn again."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from irl.advice import AVOID_MODES, Advice
from irl.bellman import BellmanTerm
from irl.choices import check_choice, check_range
from irl.demonstrations import Demonstrations
from irl.demonstrators import Demonstrator, Expert
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel
from irl.preferences import StatePreferences
from irl.queries import (
    CLUSTER_STRATEGIES,
    STATE_STRATEGIES,
    QueryContext,
    candidate_states,
    select_cluster,
    select_state,
)
from irl.training import Training, TrainingConfig, train
from irl.vr_function import VRFunction, pin, torch_generator


@dataclass(frozen=True)
class ActiveConfig:
    """Algorithm 4.1's choices; each part can be switched off by itself."""

    initial: TrainingConfig = field(default_factory=lambda: TrainingConfig(iterations=10_000))
    """Training on the initial demonstrations."""
    refine: TrainingConfig = field(default_factory=lambda: TrainingConfig(iterations=100))
    """Training after each query, from the weights at hand."""
    budget: int = 100
    """Most queries."""
    max_demonstrated: int | None = None
    """Most distinct states with labels, never exceeded; none: the budget alone decides."""
    state_query: str = "masked_entropy"
    """Which state to ask about, a name in irl.queries.STATE_STRATEGIES."""
    cluster_query: str = "masked_entropy"
    """Which cluster to ask about, a name in irl.queries.CLUSTER_STRATEGIES, or none."""
    query_beta: float = 1.0
    """Inverse temperature of (4.2) in the queries; 1 in the thesis."""
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
        check_range("query_beta", self.query_beta, 0, open_low=True)
        if self.max_demonstrated is not None:
            check_range("max_demonstrated", self.max_demonstrated, 1)


@dataclass(frozen=True)
class Progress:
    """What a callback is told: after each iteration, and once more, with q, when it is learnt.

    Attributes:
        query: 0 for the initial training, k for the one after the k-th answer.
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
class QueryRecord:
    """One turn of the loop.

    Attributes:
        state: the state asked about.
        cluster: the cluster asked about, None if none was.
        demonstrated: distinct labelled states after the answer.
        beta: the inverse temperature after the training that followed.
    """

    state: int
    cluster: str | None
    demonstrated: int
    beta: float


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


@dataclass
class _FunctionApprox:
    """FunctionApprox with everything that stays the same from call to call."""

    model: TransitionModel
    features: np.ndarray
    gamma: float
    fixed_vr: Mapping[int, float]
    preferences: StatePreferences
    avoid: str
    rng: np.random.Generator
    callback: Callable[[Progress], None] | None

    def __call__(
        self,
        network: VRFunction,
        labels: Demonstrations,
        advice: Advice,
        training: TrainingConfig,
        query: int,
    ) -> tuple[np.ndarray, np.ndarray, Training]:
        """Train ``network`` in place; return Q with advice, f with preferences, and the run."""

        def report(iteration: int, value: float) -> None:
            if self.callback is not None:
                self.callback(Progress(query, iteration, training.iterations, value, labels))

        problem = LikelihoodProblem.build(
            self.model, labels.state, labels.action, fixed_vr=self.fixed_vr
        )
        bellman = None
        if training.bellman_weight > 0:
            bellman = BellmanTerm(
                self.model,
                self.gamma,
                self.fixed_vr,
                batch=training.bellman_batch,
                delta=training.bellman_delta,
            )
        run = train(network, problem, self.features, training, self.rng, report, bellman)
        f = self.preferences.apply(pin(network.values(self.features), self.fixed_vr))
        q = advice.apply(self.model.q_values(f), self.model.mask, self.avoid)
        if self.callback is not None:
            value = run.log_likelihood[-1] if run.log_likelihood.size else float("nan")
            done = run.log_likelihood.size
            self.callback(Progress(query, done, training.iterations, float(value), labels, q))
        return q, f, run


def _within(answer: Demonstrations, labels: Demonstrations, most: int | None) -> Demonstrations:
    """Drop from ``answer`` the last states that would lift ``labels`` above ``most`` states."""
    if most is None:
        return answer
    answer = answer.resolved()
    new = ~np.isin(answer.state, labels.state)
    room = most - labels.n_states_demonstrated
    return answer.select(~new | (np.cumsum(new) <= room))


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
) -> Result:
    """Run Algorithm 4.1 from the initial demonstrations to the final action values.

    No state and no cluster is asked about twice. The loop ends early when nothing is left to
    ask about or ``config.max_demonstrated`` is reached.

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

    Raises:
        InputError: if a demonstration or an answer is invalid, or D₀ labels more states than
            ``config.max_demonstrated``.
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
    advice = Advice.none(model.n_states, model.n_actions)
    network = VRFunction(features.shape[1], config.hidden, generator=torch_generator(rng))
    function_approx = _FunctionApprox(
        model, features, gamma, fixed_vr, preferences, config.avoid, rng, callback
    )
    q, f, run = function_approx(network, labels, advice, config.initial, query=0)
    beta_learnt = config.initial.learn_beta or config.refine.learn_beta
    asked = np.zeros(0, dtype=np.int64)
    history: list[QueryRecord] = []

    for k in range(1, config.budget + 1):
        if most is not None and labels.n_states_demonstrated >= most:
            break
        context = QueryContext(
            model=model,
            q=q,
            features=features,
            demonstrated=labels.state,
            candidates=candidate_states(model, np.r_[labels.state, asked], candidates),
            beta=config.query_beta,
            start_states=start_states,
            rng=rng,
        )
        state = select_state(config.state_query, context)
        if state is None:
            break
        asked = np.append(asked, state)
        shown = Demonstrations.from_pairs(
            demonstrator.trajectory(state, rng), trajectory=int(labels.trajectory.max()) + 1
        )
        labels = labels.merge(_within(generalise(shown), labels, most))

        cluster = None
        if expert is not None and config.action_advice and config.cluster_query != "none":
            advised = {record.cluster for record in history if record.cluster is not None}
            cluster = select_cluster(config.cluster_query, context, clusters, advised)
        if expert is not None and cluster is not None:
            answer = expert.advise(cluster, clusters[cluster])
            advice = advice.add(clusters[cluster], answer.preferred, answer.avoided)

        # An inverse temperature that was learnt once is where the next training starts.
        refine = replace(config.refine, beta=run.beta) if beta_learnt else config.refine
        q, f, run = function_approx(network, labels, advice, refine, query=k)
        history.append(QueryRecord(state, cluster, labels.n_states_demonstrated, run.beta))

    return Result(q, f, run.beta, network, labels, advice, history)
