"""Episodes in the browser: what the buttons do, pressed as a browser presses them."""

import re
from time import monotonic
from urllib.request import urlopen

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator

from experiments.kit.command import Output
from experiments.simulate import live, story
from experiments.simulate.counting import told
from experiments.simulate.episodes import Job, Setting, play
from experiments.simulate.live import NEXT, PAUSE, SHOVE, Onlooker, open_meshcat, play_live
from experiments.simulate.story import Config, main
from irl.errors import InputError
from models.task.spaces import GOAL_STATE, State

FAR = State(14, 0).index


@pytest.fixture(scope="module")
def meshcat():
    return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))


def press(meshcat, name):
    packed = b"\x82\xa4type\xa6button\xa4name" + bytes([0xA0 + len(name)]) + name.encode()
    meshcat._InjectWebsocketMessage(packed)


class Person:
    """Presses buttons at certain simulated moments, and keeps what was seen at every look."""

    def __init__(self, monkeypatch, meshcat, presses):
        self.presses, self.seen = dict(presses), []
        self.slept, self.paused = 0, False
        look = Onlooker.look

        def looked(onlooker, root, episode):
            now = round(root.get_time(), 3)
            for name in self.presses.pop(now, ()):
                self.paused |= name == PAUSE
                press(meshcat, name)
            self.seen.append((now, self.cube(onlooker, root)))
            look(onlooker, root, episode)

        def sleep(seconds):
            self.slept += self.paused
            if self.slept == 3 and self.paused:
                self.paused = False
                press(meshcat, PAUSE)

        monkeypatch.setattr(Onlooker, "look", looked)
        monkeypatch.setattr(live, "sleep", sleep)

    @staticmethod
    def cube(onlooker, root):
        body = onlooker.run.station.plant.GetBodyByName("cube")
        context = onlooker.run.station.plant.GetMyContextFromRoot(root)
        return body.EvalPoseInWorld(context).translation().copy()


def test_buttons_shove_the_cube_pause_and_go_on_to_the_next(
    policy_file, meshcat, monkeypatch, capsys
):
    person = Person(monkeypatch, meshcat, {0.4: [SHOVE], 1.2: [PAUSE], 1.4: [NEXT]})
    setting = Setting(policy_file, max_actions=1, decision="table")
    result = play_live(setting, [Job(0, FAR)], meshcat)
    times = [now for now, _ in person.seen]
    assert times == pytest.approx(np.arange(0.2, 1.5, 0.2))
    moved = np.linalg.norm(person.seen[-1][1] - person.seen[0][1])
    assert 0.015 < moved < 0.055
    assert person.slept == 3  # paused, until it was pressed again
    assert (result["played"], result["skipped"], result["shoves"]) == (0, 1, 1)
    assert "(shoved)" in capsys.readouterr().out


def test_an_episode_that_nobody_shoves_is_what_it_is_unseen(policy_file, meshcat, monkeypatch):
    monkeypatch.setattr(Simulator, "set_target_realtime_rate", lambda *_: None)
    Person(monkeypatch, meshcat, {})
    setting, job = Setting(policy_file, max_actions=1), Job(0, FAR)
    seen = play_live(setting, [job], meshcat)
    assert seen["episodes"] == [told(play(setting, job, False).row)]


@pytest.mark.soak
def test_an_episode_goes_on_to_the_goal_after_a_shove(policy_file, meshcat, monkeypatch):
    monkeypatch.setattr(Simulator, "set_target_realtime_rate", lambda *_: None)
    Person(monkeypatch, meshcat, {0.4: [SHOVE]})
    shoved = play_live(Setting(policy_file), [Job(0, FAR)], meshcat)
    assert (shoved["shoves"], shoved["played"], shoved["successes"]) == (1, 1, 1)


def test_the_page_has_an_address_and_episodes_take_their_time(policy_file, monkeypatch, capsys):
    """Nobody has a browser open; the last scene stands; there is no hurry."""
    shown = open_meshcat(GOAL_STATE)
    assert shown.HasPath("goal")
    address = re.search(r"http://\S+", capsys.readouterr().out)[0]
    assert urlopen(address).status == 200
    took = []
    look = Onlooker.look

    def looked(onlooker, root, episode):
        took.append(monotonic())
        look(onlooker, root, episode)
        if len(took) == 8:
            press(shown, NEXT)

    monkeypatch.setattr(Onlooker, "look", looked)
    play_live(Setting(policy_file, max_actions=1), [Job(0, FAR)], shown)
    # 0.2 s of the simulation take 0.2 s, or longer where they are planned in.
    assert min(np.diff(took)) > 0.15


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("physics", False),
        ("recording", False),
        ("workers", 2),
        ("cluster", "tcp://localhost:8786"),
        ("export", "motions"),
    ],
)
def test_what_says_nothing_beside_it_is_refused(policy_file, tmp_path, option, value, monkeypatch):
    monkeypatch.setattr(story, "open_meshcat", pytest.fail)
    config = Config(policy=policy_file, out=tmp_path, live=True, **{option: value})
    with pytest.raises(InputError, match=rf"^--(no-)?{option}: .*--live") as error:
        main(config, Output(tmp_path, config))
    assert "\n" not in str(error.value)


def test_of_a_scenario_the_disturbed_episodes_are_played(policy_file, tmp_path, monkeypatch):
    monkeypatch.setattr(story, "open_meshcat", lambda goal: goal)
    monkeypatch.setattr(story, "play_live", lambda setting, jobs, _: {"jobs": jobs})
    for scenario in ("", "push"):
        config = Config(policy=policy_file, out=tmp_path, starts=4, live=True, scenario=scenario)
        jobs = main(config, Output(tmp_path, config))["jobs"]
        assert [job.number for job in jobs] == [0, 1, 2, 3]
        assert {job.disturbed for job in jobs} == {bool(scenario)}
