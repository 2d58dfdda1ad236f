"""The choices of Algorithm 4.1, and what it tells of its progress."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from irl.advice import AVOID_MODES, PREFER_MODES
from irl.choices import Limits, Settings, check_choice
from irl.cluster_queries import CLUSTER_STRATEGIES
from irl.demonstrations import Demonstrations
from irl.policy_update import POLICY_UPDATES
from irl.queries import STATE_STRATEGIES
from irl.training_config import TrainingConfig
from irl.vr_function import DEVICES, WIDEST


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
    """Which cluster to ask about: a name in irl.cluster_queries.CLUSTER_STRATEGIES, or none."""
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
    avoid: str = "doubt"
    """What happens to avoided actions: mask excludes them, unless that costs the way to where
    demonstrations ended; doubt excludes them so too, but only where that costs little by what was
    learnt from labels; thesis lowers their value."""
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
