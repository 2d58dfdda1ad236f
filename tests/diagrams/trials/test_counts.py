import numpy as np
import pytest

from diagrams.trials.counts import Evidence, count_pairs, thesis_entries, transition_entries
from diagrams.trials.record import Outcome, Pair, Trial, TrialRecord
from models.rotations import matrix_to_rotation_vector
from models.task.estimate import estimated_transitions
from models.task.pairs import nominal_pairs
from models.task.spaces import (
    LOST,
    N_ACTIONS,
    N_STATES,
    R_WG,
    Action,
    Kind,
    State,
)
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()
QUARTER = (0.0, 0.0, np.pi / 2)
GRASP = Pair(State(8, 0).index, Action(Kind.GRASP, 10).index)
DROP = Pair(State(8, 0, 10).index, Action(Kind.DROP).index)


@pytest.fixture(scope="module")
def feasible():
    mask = np.zeros((N_STATES + 1, N_ACTIONS), dtype=bool)
    mask[:N_STATES] = nominal_pairs()
    return mask


def entries(feasible, *records, pair=GRASP):
    trials = [Trial(pair, number, record) for number, record in enumerate(records)]
    return transition_entries(feasible, trials, CLASSES)


def outcomes(found, state, action):
    here = (found.state == state.index) & (found.action == action.index)
    return {
        int(s): (float(p), int(n), int(e))
        for s, p, n, e in zip(
            found.next_state[here],
            found.probability[here],
            found.count[here],
            found.evidence[here],
            strict=True,
        )
    }


HELD, FAILED = TrialRecord(Outcome.HELD), TrialRecord(Outcome.FREE)


def test_every_feasible_pair_has_probabilities_that_sum_to_one(feasible):
    found = entries(feasible, HELD, HELD, FAILED)
    pair = found.key
    total = np.bincount(pair, found.probability, minlength=feasible.size)
    assert total[feasible.ravel()] == pytest.approx(1.0)
    assert not total[~feasible.ravel()].any()


def test_the_tried_pair_is_measured_and_its_class_follows_by_symmetry(feasible):
    found = entries(feasible, HELD, HELD, FAILED)
    middle, grasp = State(8, 0), Action(Kind.GRASP, 10)
    expected = {
        State(8, 0, 10).index: (pytest.approx(2 / 3), 2, Evidence.MEASURED),
        middle.index: (pytest.approx(1 / 3), 1, Evidence.MEASURED),
    }
    assert outcomes(found, middle, grasp) == expected
    # A quarter turn of the gripper and another face up: the same physics.
    kin = outcomes(found, State(0, 8), Action(Kind.GRASP, 12))
    assert kin[State(0, 8, 12).index] == (pytest.approx(2 / 3), 2, Evidence.KERNEL)
    # Half of a right angle is another class, without trials.
    other = outcomes(found, middle, Action(Kind.GRASP, 11))
    assert other == {State(8, 0, 11).index: (1.0, 0, Evidence.ESTIMATED)}


def test_a_turn_measured_in_one_frame_is_carried_to_another(feasible):
    tipped = TrialRecord(Outcome.FREE, turn=(0.0, np.pi / 2, 0.0), displacement=(0.04, 0.0, -0.03))
    found = entries(feasible, tipped, pair=DROP)
    drop = Action(Kind.DROP)
    # The gripper's y axis, about which the cube tipped, turns with the gripper by 90°.
    (here,) = outcomes(found, State(8, 0, 10), drop)
    assert here == State(14, 40).index
    there = outcomes(found, State(8, 0, 12), drop)
    # Several scene maps lead there, but one trial takes one of them.
    assert len(there) == 1
    after = State.from_index(next(iter(there)))
    assert after.orientation in {8, 32}
    assert after.position in {8}


def test_what_leaves_the_grid_is_lost(feasible):
    far = TrialRecord(Outcome.FREE, displacement=(0.2, 0.0, -0.03))
    found = entries(feasible, far, pair=DROP)
    assert list(outcomes(found, State(8, 0, 10), Action(Kind.DROP))) == [LOST]


def test_faults_judge_nothing(feasible):
    found = entries(feasible, HELD, TrialRecord(Outcome.FAULT, fault="solver"))
    held = outcomes(found, State(8, 0), Action(Kind.GRASP, 10))
    assert held == {State(8, 0, 10).index: (1.0, 1, Evidence.MEASURED)}


def test_pairs_are_counted_by_evidence(feasible):
    counts = count_pairs(entries(feasible, HELD))
    members = int(CLASSES.hands.n_members[CLASSES.hands.pair_class[0, 10]])
    assert counts["grasp"]["measured"] == 1
    assert counts["grasp"]["kernel"] == 9 * members - 1
    assert counts["rotate"]["measured"] + counts["rotate"]["kernel"] == 0
    assert sum(sum(row.values()) for row in counts.values()) == feasible.sum()


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_the_order_of_trials_does_not_matter(feasible, order):
    records = [HELD, FAILED, TrialRecord(Outcome.HELD, turn=QUARTER)]
    shuffled = [Trial(GRASP, number, records[number]) for number in order]
    found = transition_entries(feasible, shuffled, CLASSES)
    straight = entries(feasible, *records)
    assert all(np.array_equal(a, b) for a, b in zip(found, straight, strict=True))


def rigid(pair):
    """What a hand that never slips would record."""
    state, action = State.from_index(pair.state), Action.from_index(pair.action)
    if action.kind == Kind.DROP:
        return TrialRecord(Outcome.FREE)
    if action.kind != Kind.ROTATE:
        return TrialRecord(Outcome.HELD)
    turn = R_WG[action.target] @ R_WG[state.gripper].T
    return TrialRecord(Outcome.HELD, turn=tuple(matrix_to_rotation_vector(turn)))


def test_trials_of_a_rigid_hand_give_every_pair_what_geometry_says(feasible):
    trials = []
    for number in range(CLASSES.n_classes):
        pair = Pair(*map(int, CLASSES.tried(number, 0)))
        trials.append(Trial(pair, 0, rigid(pair)))
    found = transition_entries(feasible, trials, CLASSES)
    assert not (found.evidence == Evidence.ESTIMATED).any()
    estimate = estimated_transitions(feasible)
    likely = {
        (s, a): set()
        for s, a in zip(estimate.state.tolist(), estimate.action.tolist(), strict=True)
    }
    for s, a, n in zip(*(column.tolist() for column in estimate[:3]), strict=True):
        likely[s, a].add(n)
    # One trial has one outcome; where two orientations are equally near, it is one of them.
    assert len(found.state) == len(likely)
    for s, a, n in zip(*(column.tolist() for column in found[:3]), strict=True):
        assert n in likely[s, a]


def test_a_translation_is_measured_where_it_was_tried_and_follows_elsewhere(feasible):
    there = Action(Kind.TRANSLATE, 5)
    pair = Pair(State(2, 0, 10).index, there.index)
    found = entries(feasible, HELD, pair=pair)
    here = outcomes(found, State(2, 0, 10), there)
    assert here == {State(5, 0, 10).index: (1.0, 1, Evidence.MEASURED)}
    other = outcomes(found, State(17, 8, 12), Action(Kind.TRANSLATE, 0))
    assert other == {State(0, 8, 12).index: (1.0, 1, Evidence.KERNEL)}


def test_the_thesis_kernel_speaks_for_its_own_classes_alone(feasible):
    found = thesis_entries(feasible, [Trial(GRASP, 0, HELD)])
    grasp = Action(Kind.GRASP, 10)
    # Another column, and another quarter turn of the cube; not another gripper.
    assert outcomes(found, State(2, 6), grasp)[State(2, 6, 10).index][0] == 1.0
    assert not outcomes(found, State(8, 0), Action(Kind.GRASP, 12))
    assert not outcomes(found, State(8, 1), grasp)
    # A translation upwards speaks for every gripper.
    up = Action(Kind.TRANSLATE, 9)
    raised = thesis_entries(feasible, [Trial(Pair(State(8, 0, 10).index, up.index), 0, HELD)])
    assert outcomes(raised, State(8, 2, 3), up)[State(9, 2, 3).index][0] == 1.0
