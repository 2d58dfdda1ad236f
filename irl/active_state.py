"""What Algorithm 4.1 knows between two rounds, and how it is saved and taken up again."""

from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch

from irl import checkpoint
from irl.advice import Advice
from irl.clusters import intersection
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.function_approx import Learner


@dataclass(frozen=True)
class QueryRecord:
    """One question about a state, with the one about a cluster that went along.

    Attributes:
        state: the state asked about.
        cluster: the cluster advised: the one asked about, unless the expert chose another; None
            if none was.
        demonstrated: distinct labelled states after the answer.
        beta: the inverse temperature after the training that followed.
    """

    state: int
    cluster: str | None
    demonstrated: int
    beta: float


@dataclass
class ActiveState:
    """Everything that changes from round to round.

    Attributes:
        learner: the main network.
        committee: the committee, None if no strategy asks for one.
        labels: all demonstrations.
        advice: all advice.
        clusters: name → state indices; an expert may add to them.
        rng: the source of chance, but for the committee's own.
        asked: states asked about.
        asked_clusters: clusters asked or spoken about.
        history: one record a question.
    """

    learner: Learner
    committee: Committee | None
    labels: Demonstrations
    advice: Advice
    clusters: dict[str, np.ndarray]
    rng: np.random.Generator
    asked: list[int] = field(default_factory=list)
    asked_clusters: list[str] = field(default_factory=list)
    history: list[QueryRecord] = field(default_factory=list)

    def is_full(self, most: int | None) -> bool:
        """Whether ``most`` states have labels; never without a limit."""
        return most is not None and self.labels.n_states_demonstrated >= most

    def learn_of(self, answer: Demonstrations, most: int | None) -> None:
        """Add labels, but for the last ones that would lift the labelled states above ``most``."""
        if most is not None:
            answer = answer.resolved()
            new = ~np.isin(answer.state, self.labels.state)
            room = most - self.labels.n_states_demonstrated
            answer = answer.select(~new | (np.cumsum(new) <= room))
        self.labels = self.labels.merge(answer)

    def speak_of(self, cluster: str) -> None:
        """Note that ``cluster`` is dealt with; a new intersection joins the clusters.

        Raises:
            InputError: if it is neither a cluster nor an intersection of clusters.
        """
        if cluster not in self.clusters:
            self.clusters[cluster] = intersection(self.clusters, cluster)
        self.asked_clusters.append(cluster)

    @property
    def _learners(self) -> list[Learner]:
        return [self.learner, *(self.committee.members if self.committee else [])]

    @property
    def _generators(self) -> list[np.random.Generator]:
        return [self.rng, *([self.committee.rng] if self.committee else [])]

    def save(self, path: Path, identity: Mapping[str, Any]) -> None:
        """Write all of it but ``clusters``, which the run is given again; see ``identity``.

        Raises:
            OSError: if the file cannot be written.
        """
        arrays = {f"labels.{c.name}": getattr(self.labels, c.name) for c in fields(self.labels)}
        arrays |= {"advice.preferred": self.advice.preferred, "advice.avoided": self.advice.avoided}
        for k, learner in enumerate(self._learners):
            arrays[f"network.{k}"] = learner.network.parameters.cpu().numpy()
            if learner.weight is not None:
                arrays[f"weight.{k}"] = learner.weight
        state = {
            "beta": [learner.beta for learner in self._learners],
            "rng": [checkpoint.rng_state(rng) for rng in self._generators],
            "asked": self.asked,
            "asked_clusters": self.asked_clusters,
            "history": [astuple(record) for record in self.history],
        }
        checkpoint.save(path, arrays, state, identity)

    def restore(self, path: Path, identity: Mapping[str, Any]) -> None:
        """Become what was saved.

        Raises:
            InputError: if the file is damaged, or belongs to a run of another ``identity``.
        """
        arrays, state = checkpoint.load(path, identity)
        self.labels = Demonstrations(
            **{c.name: arrays[f"labels.{c.name}"] for c in fields(self.labels)}
        )
        self.advice = Advice(arrays["advice.preferred"], arrays["advice.avoided"])
        for k, (learner, beta) in enumerate(zip(self._learners, state["beta"], strict=True)):
            learner.network.parameters.copy_(torch.from_numpy(arrays[f"network.{k}"]))
            learner.weight = arrays.get(f"weight.{k}")
            learner.beta = beta
        for rng, saved in zip(self._generators, state["rng"], strict=True):
            checkpoint.restore_rng(rng, saved)
        self.asked = state["asked"]
        for cluster in state["asked_clusters"]:
            self.speak_of(cluster)
        self.history = [QueryRecord(*record) for record in state["history"]]


def identity(
    state: ActiveState, config: Any, index_sets: Mapping[str, np.ndarray | None]
) -> dict[str, Any]:
    """What tells one run of Algorithm 4.1 from others, for a fresh ``state``.

    Args:
        state: before any training.
        config: the run's dataclass of settings.
        index_sets: states by what they are for; None where all are meant.

    Returns:
        Settings by name, and hashes of all inputs that are data. Demonstrator, expert and
        generalisation are not among them.
    """
    at, labels = state.learner.surroundings, state.labels
    P = at.model.P
    return {
        **asdict(config),
        "model": checkpoint.fingerprint(
            at.model.pair_state, at.model.pair_action, P.data, P.indices, P.indptr
        ),
        "features": checkpoint.fingerprint(at.features),
        "gamma": at.gamma,
        "fixed_vr": sorted((int(s), float(v)) for s, v in at.fixed_vr.items()),
        "demonstrations": checkpoint.fingerprint(
            *(getattr(labels, column.name) for column in fields(labels))
        ),
        "clusters": {
            name: checkpoint.fingerprint(np.asarray(states))
            for name, states in state.clusters.items()
        },
        **{
            name: None if states is None else checkpoint.fingerprint(np.asarray(states))
            for name, states in index_sets.items()
        },
        "rng": checkpoint.rng_state(state.rng),
    }
