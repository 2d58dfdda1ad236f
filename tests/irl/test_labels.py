from dataclasses import replace

import numpy as np
import pytest
import torch

from irl.baselines.action_advice import uncertainty
from irl.baselines.birl import SamplingConfig, birl
from irl.demonstrations import SOURCES, Demonstrations
from irl.demonstrators import RecordedDemonstrator
from irl.domains.gridworld import LEFT, RIGHT, UP, GridWorld
from irl.labels import Labels
from irl.method_inputs import labelled_policy
from irl.methods import METHODS, learn
from irl.training_config import TrainingConfig

torch.set_num_threads(1)  # networks this small gain nothing from more

WORLD = GridWorld(3, (2, 1))
FAST = {
    "birl": {"sampling": SamplingConfig(chains=2, samples=20)},
    "deep_max_ent": {"iterations": 60},
    "fa_mlirl": {"training": TrainingConfig(iterations=300, step=0.01, beta=50)},
    "linear_mlirl": {"max_iterations": 100},
    "bellman_gradient": {"max_iterations": 100},
}


def of_sources(rows):
    """Labels by hand: (state, action, source), each a run of its own."""
    shown = Demonstrations.from_labels([row[:2] for row in rows])
    return replace(shown, source=np.array([SOURCES.index(row[2]) for row in rows]))


def by_hand(rows):
    """Counts of the highest rank, in plain Python."""
    counts = {}
    for state in {row[0] for row in rows}:
        here = [row for row in rows if row[0] == state]
        counted = [row for row in here if row[2] != "generalised"] or here
        for _, action, _ in counted:
            counts[state, action] = counts.get((state, action), 0) + 1
    return counts


@pytest.mark.parametrize("seed", range(5))
def test_labels_are_counted_by_state_and_rank_in_any_order(seed):
    rng = np.random.default_rng(seed)
    rows = [
        (int(rng.integers(8)), int(rng.integers(3)), SOURCES[rng.integers(3)]) for _ in range(40)
    ]
    labels = of_sources(rows).counted
    counts = by_hand(rows)
    found = zip(labels.state.tolist(), labels.action.tolist(), strict=True)
    assert dict(zip(found, labels.count.tolist(), strict=True)) == counts
    shown = {row[0] for row in rows if row[2] != "generalised"}
    assert labels.shown.tolist() == [state in shown for state in labels.state.tolist()]
    for state, action in enumerate(labels.policy(9).tolist()):
        of_state = {a: n for (s, a), n in counts.items() if s == state}
        if not of_state:
            assert action == -1
            continue
        # Of those given most often, the one given first, by a row of the state's highest rank.
        ranked = [a for s, a, who in rows if s == state and (who != "generalised") == (s in shown)]
        most = max(of_state.values())
        assert action == next(a for a in ranked if of_state[a] == most)
    again = of_sources([rows[k] for k in rng.permutation(len(rows))]).counted
    for column in ("state", "action", "count", "shown"):
        np.testing.assert_array_equal(getattr(again, column), getattr(labels, column))


def test_no_labels_are_no_labels():
    labels = Demonstrations.empty().counted
    assert isinstance(labels, Labels)
    assert len(labels) == len(labels.most_frequent()) == 0
    assert labels.policy(3).tolist() == [-1] * 3
    assert len(Demonstrations.empty().resolved()) == 0


CELL = 3
"""On the left border of the grid, on the goal's row: to the right is best."""


def lesson(right, wrong, source="demonstrator"):
    """Ways from the corners; and of one cell so many right answers and wrong ones."""
    walks = WORLD.trajectories("diagonal")
    answers = [[(CELL, RIGHT)]] * right + [[(CELL, UP)]] * wrong
    runs = [
        Demonstrations.from_pairs(run, number, source if number >= len(walks) else "demonstrator")
        for number, run in enumerate([*walks, *answers])
    ]
    return Demonstrations.concatenate(runs)


def learnt(name, shown):
    """Action values; of birl, whose mean reward is vague, the policies' mean instead."""
    options = FAST.get(name, {})
    if name == "birl":
        given, seed = {"gamma": 0.9, "config": options["sampling"]}, np.random.default_rng(0)
        return WORLD.model.table(birl(WORLD.model, shown, rng=seed, **given).policy)
    rng = np.random.default_rng(0)
    return learn(name, WORLD.model, shown, WORLD.features, gamma=0.9, rng=rng, **options).q


@pytest.mark.parametrize("name", METHODS)
def test_one_slip_does_not_outweigh_nine_right_answers_wherever_it_stands(name):
    shown = lesson(9, 1)
    slip = np.flatnonzero((shown.state == CELL) & (shown.action == UP))
    first = shown.select(np.r_[slip, np.setdiff1d(np.arange(len(shown)), slip)])
    backwards = shown.select(np.arange(len(shown))[::-1])
    q = learnt(name, shown)
    assert q[CELL].argmax() == RIGHT
    for other in (first, backwards):
        assert learnt(name, other).tobytes() == q.tobytes()


@pytest.mark.parametrize("name", sorted(METHODS.keys() - {"max_ent", "deep_max_ent"}))
def test_what_was_shown_outranks_whatever_was_generalised_to_it(name):
    """A rule says ten times what the demonstrator, once, denied."""
    shown = lesson(1, 0)
    overruled = replace(lesson(0, 10, "generalised"), trajectory=lesson(0, 10).trajectory + 50)
    overruled = overruled.select(overruled.generalised)
    both = Demonstrations.concatenate([overruled, shown])
    assert learnt(name, both).tobytes() == learnt(name, shown).tobytes()


def test_one_action_a_state_is_the_most_frequent_of_the_highest_rank():
    rows = [(CELL, UP, "generalised")] * 20 + [(CELL, UP, "human")] + [(CELL, RIGHT, "human")] * 3
    shown = of_sources(rows)
    assert labelled_policy(WORLD.model, shown)[CELL] == RIGHT
    assert shown.resolved().pairs == [(CELL, RIGHT)]
    tie = shown.select(np.array([0, 20, 21]))
    assert tie.resolved().pairs == [(CELL, UP)]


def test_a_recording_repeats_what_it_holds_most_often():
    right = [(CELL, RIGHT), (CELL + 1, RIGHT)]
    shown = Demonstrations.from_trajectories([[(CELL, UP)], right, right, [(CELL, UP)], right])
    for rows in (np.arange(len(shown)), np.arange(len(shown))[::-1]):
        teacher = RecordedDemonstrator(shown.select(rows))
        assert teacher.label(CELL, np.random.default_rng(0)) == RIGHT
        assert teacher.trajectory(CELL, np.random.default_rng(0)) == right


def test_doubt_about_a_state_goes_by_what_was_shown_there():
    shown = of_sources([(CELL, RIGHT, "human")])
    denied = of_sources([(CELL, RIGHT, "human"), *[(CELL, LEFT, "generalised")] * 5])
    q = np.zeros(WORLD.model.mask.shape)
    np.testing.assert_array_equal(
        uncertainty(WORLD.model, shown, q), uncertainty(WORLD.model, denied, q)
    )
