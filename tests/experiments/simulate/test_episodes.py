"""Episodes in physics: the same bits in any process and order; what was interrupted goes on."""

import hashlib
import json

import numpy as np
import pytest

from diagrams.scenarios import load_scenario
from experiments.kit.command import Output
from experiments.kit.kept_rows import KEPT
from experiments.simulate import episodes, story
from experiments.simulate.episodes import Crew, Job, Outcome, Setting, outcomes, play
from irl.errors import InputError
from models.task.spaces import State

STARTS = [State(14, 0).index, State(4, 9).index]


def bits(outcome):
    """All that is kept of an episode but for the time it took, to the last bit."""
    row = {key: value for key, value in outcome.row.items() if key != "cpu_s"}
    return json.dumps(row, sort_keys=True)


def test_an_episode_is_the_same_bits_in_any_order_and_process(policy_file):
    setting = Setting(policy_file, max_actions=1, scenario=load_scenario("push").text(), seed=4)
    jobs = [Job(number, start, 0, bool(number)) for number, start in enumerate(STARTS)]
    here = {job: bits(play(setting, job, False)) for job in reversed(jobs)}
    there = outcomes([(setting, job, True) for job in jobs], Crew(workers=2))
    frames = []
    for (_, job, _), outcome in there:
        assert bits(outcome) == here[job]
        frames.append(outcome.played.frames)
    assert all(np.isfinite(each).all() and len(each) > 24 for each in frames)
    # Once more, after another one.
    assert bits(play(setting, jobs[0], False)) == here[jobs[0]]
    assert json.loads(here[jobs[1]])["acted"]


def acted(setting, job, whole):
    """An episode that costs nothing."""
    row = {
        **{"number": job.number, "repetition": job.repetition, "disturbed": job.disturbed},
        **{"start": job.start, "verdict": "goal", "actions": [3], "states": [7]},
        **{"chosen_by": ["policy"], "action_failures": [""], "success": True},
        **{"false_success": False, "seconds": 0.1 * job.number, "fault": "", "acted": True},
        **{"limits": None, "cpu_s": 1.0},
    }
    return Outcome(row)


def test_what_was_interrupted_goes_on_to_the_same_rows_and_hash(policy_file, tmp_path, monkeypatch):
    played = []

    def until(last):
        def each(setting, job, whole):
            if len(played) == last:
                raise KeyboardInterrupt
            played.append(job)
            return acted(setting, job, whole)

        return each

    def run(folder, **options):
        config = story.Config(
            policy=policy_file, out=folder, starts=6, scenario="push", recording=False, **options
        )
        return story.main(config, Output(folder, config))

    monkeypatch.setattr(episodes, "play", until(-1))
    whole = run(tmp_path / "whole")
    assert len(played) == 12
    played.clear()
    monkeypatch.setattr(episodes, "play", until(5))
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "cut")
    assert (tmp_path / "cut" / KEPT).is_file()
    monkeypatch.setattr(episodes, "play", until(-1))
    with pytest.raises(InputError, match=r"kept by other work, differing in .*seed"):
        run(tmp_path / "cut", seed=1)
    resumed = run(tmp_path / "cut")
    assert len(played) == len(set(played)) == 12
    assert resumed == whole
    file = (tmp_path / "cut/episodes.csv").read_bytes()
    assert resumed["episodes_sha256"] == hashlib.sha256(file).hexdigest()
    assert not (tmp_path / "cut" / KEPT).exists()
    assert (resumed["trials"], resumed["undisturbed"]["trials"]) == (6, 6)
    assert resumed["paired"]["pairs"] == 6
