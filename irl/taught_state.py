"""What a learner was taught and has asked, whoever learns."""

from dataclasses import dataclass, field

import numpy as np

from irl.advice import Advice
from irl.clusters import intersection
from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel


@dataclass
class TaughtState:
    """What was taught and asked, whoever learns from it.

    Attributes:
        labels: all demonstrations.
        advice: all advice.
        clusters: name → state indices; an expert may add to them.
        rng: the source of chance, but for a committee's own.
        asked: states asked about.
        asked_clusters: clusters asked or spoken about.
    """

    labels: Demonstrations
    advice: Advice
    clusters: dict[str, np.ndarray]
    rng: np.random.Generator
    asked: list[int] = field(default_factory=list)
    asked_clusters: list[str] = field(default_factory=list)

    def is_full(self, most: int | None) -> bool:
        """Whether ``most`` states have labels; never without a limit."""
        return most is not None and self.labels.n_states_demonstrated >= most

    def learn_of(self, answer: Demonstrations, most: int | None = None) -> None:
        """Add labels, but for those of the last states that would lift the labelled ones above.

        An answer under the number of an earlier one replaces it: see ``Demonstrations.corrected``.
        """
        if most is not None:
            states = answer.states_by_rank
            new = states[~np.isin(states, self.labels.state)]
            surplus = new[most - self.labels.n_states_demonstrated :]
            answer = answer.select(~np.isin(answer.state, surplus))
        self.labels = self.labels.corrected(answer)

    def speak_of(self, cluster: str) -> None:
        """Note that ``cluster`` is dealt with; a new intersection joins the clusters.

        Raises:
            InputError: if it is neither a cluster nor an intersection of clusters.
        """
        if cluster not in self.clusters:
            self.clusters[cluster] = intersection(self.clusters, cluster)
        self.asked_clusters.append(cluster)

    def ends(self, model: TransitionModel) -> np.ndarray:
        """Where demonstrators ended, or were asked and showed nothing: int64."""
        silent = np.setdiff1d(np.array(self.asked, dtype=np.int64), self.labels.state)
        return np.union1d(self.labels.ended_in(model), silent)
