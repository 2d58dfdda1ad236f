"""What crosses from counting to learning keeps its names."""

import dataclasses

import numpy as np

from diagrams.trials.counts import Evidence, TransitionEntries, transition_entries
from experiments.kit.shipped_data import load_feasibility
from experiments.transitions.export import to_entries, to_transitions
from irl.task_data import EVIDENCE, Transitions
from models.task.trial_classes import trial_classes


def test_both_sides_name_evidence_and_columns_alike_and_in_one_order():
    assert tuple(evidence.name.lower() for evidence in Evidence) == EVIDENCE
    assert [int(evidence) for evidence in Evidence] == list(range(len(EVIDENCE)))
    columns = tuple(field.name for field in dataclasses.fields(Transitions))
    assert columns == TransitionEntries._fields


def test_entries_come_back_from_task_data_as_they_went():
    entries = transition_entries(load_feasibility().mask(), [], trial_classes())
    again = to_entries(to_transitions(entries))
    assert all(map(np.array_equal, entries, again))
    assert again.evidence[0] == Evidence.ESTIMATED
