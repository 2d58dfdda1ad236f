"""What the transition model is exported as: task data for `irl`, and the tables of thesis 5.9."""

import platform
from collections.abc import Iterable
from importlib.metadata import version

import numpy as np

from diagrams.trials.counts import Evidence, TransitionEntries
from diagrams.trials.database import TrialDatabase
from experiments.kit.command import Output
from experiments.kit.shipped_data import MAP, SHIPPED_ROBOT, load_feasibility
from irl.files import sha256
from irl.formats import write_csv, write_json
from irl.generalisation import Generalisation
from irl.metrics import wilson_intervals
from irl.task_data import TaskData, Transitions
from models.task.clusters import clusters, state_preferences
from models.task.features import rotation_features, thesis_features
from models.task.generalisation import RULES, generalisation_groups
from models.task.pairs import split_key
from models.task.spaces import GOAL_STATE, LOST, N_FREE
from models.task.tables import ACTION_COLUMNS, STATE_COLUMNS, action_rows, state_rows

TABLE = "transitions.csv"
FIELDS = TransitionEntries._fields
MODEL, COUNTS, SUCCESSORS = "transition_model.json", "pair_counts.json", "next_states.json"


def to_transitions(entries: TransitionEntries) -> Transitions:
    """Entries as task data hold them."""
    return Transitions(**entries._asdict())


def to_entries(transitions: Transitions) -> TransitionEntries:
    """The grasping task's entries out of its task data."""
    return TransitionEntries(**{name: getattr(transitions, name) for name in FIELDS})


def task_data(database: TrialDatabase, entries: TransitionEntries) -> TaskData:
    """Gather everything `irl` needs of the grasping task."""
    feasible = load_feasibility().mask()
    preferences = state_preferences(entries.state, entries.next_state)
    return TaskData(
        name="grasp",
        states=_table(STATE_COLUMNS, state_rows()),
        actions=_table(ACTION_COLUMNS, action_rows()),
        transitions=to_transitions(entries),
        goal_states=np.array([GOAL_STATE]),
        start_states=np.arange(N_FREE),
        gamma=0.95,
        features={"thesis": thesis_features(), "rotation": rotation_features()},
        clusters=clusters(),
        preferred=preferences["preferred"],
        avoided=preferences["avoided"],
        generalisation=Generalisation(*generalisation_groups(feasible), rule_names=list(RULES)),
        fixed_vr={LOST: -1.0},
        provenance={
            "campaign": database.content,
            "campaign_hash": database.hash,
            "trials": len(database.done()),
            "reachability_map": sha256(SHIPPED_ROBOT / MAP),
            "packages": {name: version(name) for name in ("drake", "numpy")},
            "python": platform.python_version(),
        },
    )


def save_tables(entries: TransitionEntries, output: Output) -> None:
    """Write the model as thesis 5.9 stores it, and a table that says how sure it is.

    The thesis' three files are dictionaries: the probability of each trio ``"s, a, s'"``, and by
    pair ``"s, a"`` the number of trials and the states that may follow. ``transitions.csv`` has
    one row per trio, with Wilson's 95 % interval where trials stand behind it.
    """
    pairs, first, row = np.unique(entries.key, return_index=True, return_inverse=True)
    trials = np.bincount(row, entries.count, minlength=pairs.size).astype(np.int64)
    low, high = wilson_intervals(entries.count, trials[row])
    columns = {
        **entries._asdict(),
        "evidence": [Evidence(e).name.lower() for e in entries.evidence],
        "low": ["" if np.isnan(v) else f"{v:.6f}" for v in low],
        "high": ["" if np.isnan(v) else f"{v:.6f}" for v in high],
    }
    with output.file(TABLE) as path:
        write_csv(path, list(columns), zip(*columns.values(), strict=True))

    state, action = (part.tolist() for part in split_key(pairs))
    names = [f"{s}, {a}" for s, a in zip(state, action, strict=True)]
    successors = np.split(entries.next_state, first[1:])
    dictionaries = {
        MODEL: {
            f"{names[r]}, {s}": p
            for r, s, p in zip(row, entries.next_state, entries.probability.tolist(), strict=True)
        },
        COUNTS: dict(zip(names, trials.tolist(), strict=True)),
        SUCCESSORS: {n: s.tolist() for n, s in zip(names, successors, strict=True)},
    }
    for name, content in dictionaries.items():
        with output.file(name) as path:
            write_json(path, content)


def _table(columns: Iterable[str], rows: Iterable[tuple[str, ...]]) -> list[dict[str, str]]:
    """Rows by column name; the index is the place in the list."""
    table = [dict(zip(columns, row, strict=True)) for row in rows]
    return [{name: value for name, value in row.items() if name != "index"} for row in table]
