import time
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from irl.demonstrations import SOURCES
from irl.errors import InputError
from irl.records import from_arrays, from_episodes, from_moves

RUNS = [[(0, 1), (1, 1), (2, 0)], [(4, 0)]]
STATE, ACTION = np.array([0, 1, 2, 4]), np.array([1, 1, 0, 0])


def runs_of(shown):
    """What was shown, run by run; the steps must count from 0."""
    result = []
    for number in np.unique(shown.trajectory):
        rows = shown.trajectory == number
        assert shown.step[rows].tolist() == list(range(rows.sum()))
        result.append(
            list(zip(shown.state[rows].tolist(), shown.action[rows].tolist(), strict=True))
        )
    return result


@dataclass
class Trajectory:
    """As `imitation.data.types.Trajectory` is, by its attributes."""

    obs: Any
    acts: Any
    infos: Any = None
    terminal: bool = True


@dataclass
class EpisodeData:
    """As `minari.EpisodeData` is, by its attributes."""

    id: int
    observations: Any
    actions: Any
    rewards: Any = None
    terminations: Any = None
    truncations: Any = None
    infos: Any = None


@pytest.mark.parametrize(
    "ends", [{"lengths": [3, 1]}, {"ends": np.array([0, 0, 1, 1], bool)}, {"ends": STATE == 2}]
)
def test_flat_arrays_are_parted_where_they_say(ends):
    shown = from_arrays(STATE, ACTION, **ends, source="human")
    assert runs_of(shown) == RUNS
    assert {SOURCES[k] for k in shown.source} == {"human"}
    assert len(from_arrays([], [], lengths=[])) == len(from_arrays([], [], ends=STATE[:0] > 0)) == 0


def test_many_runs_are_read_quickly():
    n = 200_000
    began = time.process_time()
    shown = from_arrays(np.arange(n) % 50, np.arange(n) % 4, lengths=[10] * (n // 10))
    assert time.process_time() - began < 5
    assert shown.trajectory[[0, 9, 10, -1]].tolist() == [0, 0, 1, n // 10 - 1]
    assert shown.step[[0, 9, 10, -1]].tolist() == [0, 9, 0, 9]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, r"give one of both, .* all one run, lengths=\[len\(state\)\]"),
        ({"lengths": [4], "ends": STATE > 9}, "give one of both"),
        ({"lengths": [3, 2]}, "lengths: must sum to 4 pairs, sum to 5"),
        ({"lengths": [4, 0]}, "lengths: must lie in 1…"),
        ({"ends": [0, 0, 1, 1]}, r"ends: bool \[4\] wanted, got int64 \[4\]; .*astype\(bool\)"),
        ({"ends": [False, True]}, r"ends: bool \[4\] wanted, got bool \[2\]"),
    ],
)
def test_where_runs_end_is_asked_for_and_not_guessed(given, words):
    with pytest.raises(InputError, match=words):
        from_arrays(STATE, ACTION, **given)


def test_arrays_of_another_kind_are_refused_by_name():
    with pytest.raises(InputError, match="action: as many as states wanted, 4, got 3"):
        from_arrays(STATE, ACTION[:3], lengths=[4])
    with pytest.raises(InputError, match=r"state: integers .* got floats"):
        from_arrays(STATE + 0.5, ACTION, lengths=[4])


def test_moves_are_runs_of_state_action_and_next_state():
    runs = [np.array([(0, 1, 1), (1, 1, 2), (2, 0, 1)]), [(4, 0, 3)]]
    assert runs_of(from_moves(runs)) == RUNS


def test_moves_that_do_not_follow_one_another_are_named():
    with pytest.raises(InputError, match="run 1: move 0 leads to state 1, but move 1 begins in 4"):
        from_moves([[(0, 1, 1)], [(0, 1, 1), (4, 0, 3)]])
    with pytest.raises(InputError, match=r"got moves; if they are one run, give \[moves\]"):
        from_moves([(0, 1, 1), (1, 1, 2)])
    with pytest.raises(InputError, match=r"run 0: integers \[n, 3\] wanted, got int64 \[1, 2\]"):
        from_moves([[(0, 1)]])


def episodes(make):
    return [make(np.array([0, 1, 2, 1]), np.array([1, 1, 0])), make([4, 3], [0])]


KINDS = {
    "imitation": Trajectory,
    "minari": lambda seen, done: EpisodeData(0, seen, done),
    "mapping": lambda seen, done: {"observations": seen, "actions": done},
    "short mapping": lambda seen, done: {"obs": seen, "acts": done},
}


@pytest.mark.parametrize("kind", KINDS)
def test_episodes_are_known_by_their_attributes(kind):
    assert runs_of(from_episodes(episodes(KINDS[kind]))) == RUNS
    assert runs_of(from_episodes(iter(episodes(KINDS[kind])))) == RUNS


def test_a_data_set_gives_its_episodes():
    found = SimpleNamespace(iterate_episodes=lambda: iter(episodes(KINDS["minari"])))
    assert runs_of(from_episodes(found)) == RUNS


def test_observations_that_are_no_indices_become_such_by_state_of():
    one_hot = [Trajectory(np.eye(5)[[0, 1, 2, 1]], [1, 1, 0]), Trajectory(np.eye(5)[[4, 3]], [0])]
    found = from_episodes(one_hot, state_of=lambda seen: seen.argmax(axis=1))
    assert runs_of(found) == RUNS
    with pytest.raises(InputError, match=r"episode 0: observations: .* \[4, 5\]; .* give state_of"):
        from_episodes(one_hot)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([Trajectory([0, 1], [1]), Trajectory([0, 1], [1, 1])], "episode 1: 2 observations and 2"),
        (Trajectory([0, 1], [1]), r"got one; if it is a single run, give \[episode\]"),
        ([(0, 1)], "episode 0: tuple has neither obs and acts nor"),
        ([EpisodeData(0, {"x": [0, 1]}, [1])], "episode 0: observations: .* give state_of"),
        ([Trajectory([0, 1], [[0.5]])], "episode 0: actions: integers"),
    ],
)
def test_what_is_no_episode_is_refused_by_name(given, words):
    with pytest.raises(InputError, match=words):
        from_episodes(given)


def test_imitations_own_trajectories():
    types = pytest.importorskip("imitation.data.types")

    def make(seen, done):
        return types.Trajectory(np.array(seen), np.array(done), infos=None, terminal=True)

    assert runs_of(from_episodes(episodes(make))) == RUNS


def test_minaris_own_episodes():
    minari = pytest.importorskip("minari")

    def make(seen, done):
        nothing = np.zeros(len(done))
        fields = {"rewards": nothing, "terminations": nothing, "truncations": nothing, "infos": {}}
        return minari.EpisodeData(
            id=0, observations=np.array(seen), actions=np.array(done), **fields
        )

    assert runs_of(from_episodes(episodes(make))) == RUNS
