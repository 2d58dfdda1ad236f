"""What Algorithm 4.1 knows between two rounds, and how it is saved and taken up again."""

from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch

from irl import checkpoint
from irl.advice import Advice
from irl.committee import Committee
from irl.demonstrations import Demonstrations
from irl.function_approx import Learner
from irl.problem import LearningProblem
from irl.taught_state import TaughtState

TRAINING = ".training-"
"""What stands between the name of a run's file and that of a training."""
EVERY = 250
"""Iterations from one saving of a training to the next."""


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


@dataclass(kw_only=True)
class ActiveState(TaughtState):
    """Everything that changes from round to round.

    Attributes:
        learner: the main network.
        committee: the committee, None if no strategy asks for one.
        history: one record a question.
    """

    learner: Learner
    committee: Committee | None
    history: list[QueryRecord] = field(default_factory=list)

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
            "caution": [learner.caution for learner in self._learners],
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
        ended_with = zip(self._learners, state["beta"], state["caution"], strict=True)
        for k, (learner, beta, caution) in enumerate(ended_with):
            learner.network.parameters.copy_(torch.from_numpy(arrays[f"network.{k}"]))
            learner.weight = arrays.get(f"weight.{k}")
            learner.beta, learner.caution = beta, caution
        for rng, saved in zip(self._generators, state["rng"], strict=True):
            checkpoint.restore_rng(rng, saved)
        self.asked = state["asked"]
        for cluster in state["asked_clusters"]:
            self.speak_of(cluster)
        self.history = [QueryRecord(*record) for record in state["history"]]


def identity(state: ActiveState, problem: LearningProblem, config: Any) -> dict[str, Any]:
    """What tells one run of Algorithm 4.1 from others, for a fresh ``state``.

    Args:
        state: before any training.
        problem: the run's learning problem.
        config: the run's dataclass of settings.

    Returns:
        Settings by name, and hashes of all inputs that are data. The teacher is not among them.
    """
    P, labels = problem.model.P, state.labels
    index_sets = {
        "candidates": problem.candidates,
        "start_states": problem.start_states,
        "preferred": problem.preferences.preferred,
        "avoided": problem.preferences.avoided,
    }
    return {
        **asdict(config),
        "model": checkpoint.fingerprint(
            problem.model.pair_state, problem.model.pair_action, P.data, P.indices, P.indptr
        ),
        "features": checkpoint.fingerprint(problem.required_features(np.float32)),
        "gamma": problem.gamma,
        "labels": "all, with their counts",  # of old, one a state
        "fixed_vr": sorted((int(s), float(v)) for s, v in problem.fixed_vr.items()),
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


@dataclass(frozen=True)
class ActiveFiles:
    """Where a run keeps what it knows: after each training in one file, and during the first ones.

    The first trainings are the long ones, of the main network and of the committee's members. Each
    has a file beside the run's own until the run's own holds what came of it. Later ones are short,
    and come after answers that a person, asked again, may not repeat.

    Attributes:
        path: the run's file; nothing is kept if None.
        identity: which run this is, see ``identity``.
    """

    path: Path | None
    identity: Mapping[str, Any]

    def restore(self, state: ActiveState) -> bool:
        """Let ``state`` become what was saved, if anything was; whether it did.

        Raises:
            InputError: if the file is damaged, or of another run.
        """
        if self.path is None or not self.path.exists():
            return False
        state.restore(self.path, self.identity)
        return True

    def save(self, state: ActiveState) -> None:
        """Save ``state``, and drop the files of the trainings that led to it.

        Raises:
            OSError: if a file cannot be written.
        """
        if self.path is not None:
            state.save(self.path, self.identity)
            for path in training_files(self.path):
                path.unlink()

    def training(self, query: int, member: int | None = None) -> checkpoint.Checkpoint | None:
        """Where a training saves itself: the one after ``query`` answers, of a committee's member.

        Returns:
            None if it does not, as any but the first.
        """
        if self.path is None or query > 0:
            return None
        name = "main" if member is None else f"member{member}"
        return checkpoint.Checkpoint(Path(f"{self.path}{TRAINING}{name}"), every=EVERY)


def training_files(path: Path) -> list[Path]:
    """Files that trainings of the run with the file ``path`` have left, of a killed one perhaps."""
    return [p for p in path.parent.iterdir() if p.name.startswith(path.name + TRAINING)]
