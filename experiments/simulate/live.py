"""Episodes in the browser while they are simulated: with buttons to pause, go on, and shove.

What a person shoves is in no seed: such episodes are not kept, recorded or exported.
"""

import contextlib
import logging
from collections.abc import Sequence
from dataclasses import replace
from time import sleep
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.framework import Context

from diagrams.policy_controller import Episode
from diagrams.policy_run import Played, PolicyRun
from diagrams.scenarios import DisturbedStation, Scenario, draw
from diagrams.scenarios.unseen_hand import shove
from experiments.kit.recording import show_goal
from experiments.simulate.counting import Row, played_row, told
from experiments.simulate.episodes import Job, Setting, build_run
from models.task import words

PAUSE, NEXT, SHOVE = "pause / go on", "next episode", "shove the cube"
"""The buttons' names."""
STANDS = 2.0
"""How long the last scene of an episode stands [s]."""
POLL = 0.05
"""Between two looks at the buttons, while nothing moves [s]."""
CAMERA = np.array([1.15, -0.75, 1.05]), np.array([0.4, 0.0, 0.6])
"""Where it is and what it looks at, in the world [m]."""


class NextEpisode(Exception):  # noqa: N818 - no error, but what a person wants
    """Somebody does not want to see this one to its end."""


class Buttons:
    """What is pressed in the browser."""

    def __init__(self, meshcat: Meshcat) -> None:
        """Put the buttons beside the picture."""
        self._meshcat = meshcat
        self._seen = dict.fromkeys((PAUSE, NEXT, SHOVE), 0)
        for name, key in ((PAUSE, "Space"), (NEXT, "KeyN"), (SHOVE, "KeyS")):
            meshcat.AddButton(name, key)

    def pressed(self, name: str) -> int:
        """How often a button was pressed since this was last asked."""
        clicks = self._meshcat.GetButtonClicks(name)
        new, self._seen[name] = clicks - self._seen[name], clicks
        return new


class Onlooker:
    """Does between two looks at an episode what the buttons say.

    Attributes:
        run: of the episodes.
        shoves: how often the cube was shoved, in all of them.
    """

    def __init__(self, run: PolicyRun, buttons: Buttons, rng: np.random.Generator) -> None:
        """Look on at the episodes of a run; ``rng`` draws what shoves are like."""
        assert isinstance(run.station, DisturbedStation)
        assert run.station.hand is not None
        self.run, self._hand = run, run.station.hand
        self._buttons, self._rng = buttons, rng
        self._paused, self._told = False, 0
        self.shoves = 0

    def begin(self, title: str) -> None:
        """Look on at another episode; what was pressed before it was not meant for it."""
        print(title, flush=True)
        self._told, self._paused = 0, False
        for name in (PAUSE, NEXT, SHOVE):
            self._buttons.pressed(name)

    def look(self, root: Context, episode: Episode) -> None:
        """Tell what was done, and heed the buttons; while it is paused, wait.

        Raises:
            NextEpisode: if that is wanted.
        """
        for step in episode.steps[self._told :]:
            print(f"    {words.describe_action(step.action)}", flush=True)
        self._told = len(episode.steps)
        while True:
            self._heed()
            if self._buttons.pressed(SHOVE):
                self._shove(root)
            if not self._paused:
                return
            sleep(POLL)

    def end(self, played: Played) -> None:
        """Let the last scene stand for a while.

        Raises:
            NextEpisode: if that is wanted sooner.
        """
        said = "the goal is reached" if played.success else played.reason
        print(f"  {said or played.episode.verdict}", flush=True)
        waited = 0.0
        while waited < STANDS or self._paused:
            self._heed()
            sleep(POLL)
            waited += POLL

    def _heed(self) -> None:
        """Heed what never depends on the scene."""
        self._paused ^= self._buttons.pressed(PAUSE) % 2 == 1
        if self._buttons.pressed(NEXT):
            raise NextEpisode

    def _shove(self, root: Context) -> None:
        before = self._hand.memory(root)
        if before.course is not None:
            return
        self._hand.now(root, shove(self._rng))
        if self._hand.memory(root).course is None:
            print("    (not shoved: the hand has the cube, or is too near)", flush=True)
        else:
            self.shoves += 1
            print("    (shoved)", flush=True)


def open_meshcat(goal: int) -> Meshcat:
    """Open a page that shows the goal; say where it is."""
    logging.getLogger("drake").setLevel(logging.WARNING)
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    show_goal(meshcat, goal)
    meshcat.SetCameraPose(*CAMERA)
    print(f"to look on, open {meshcat.web_url()}", flush=True)
    print("space pauses, S shoves the cube, N is the next; or open the controls there", flush=True)
    return meshcat


def play_live(setting: Setting, jobs: Sequence[Job], meshcat: Meshcat) -> dict[str, Any]:
    """Play episodes one after another, as fast as a real arm would.

    Args:
        setting: what they have in common.
        jobs: the episodes.
        meshcat: where to show them.

    Returns:
        What goes into ``result.json``.
    """
    # With a scenario there is a hand that can shove, even if nothing else goes otherwise.
    setting = replace(setting, scenario=setting.scenario or Scenario().text())
    run, scenario = build_run(setting, meshcat)
    assert scenario is not None
    onlooker = Onlooker(run, Buttons(meshcat), np.random.default_rng(setting.seed))
    rows: list[Row] = []
    for number, job in enumerate(jobs, 1):
        onlooker.begin(f"{number} of {len(jobs)}, {words.describe_state(job.start)}:")
        key = job.key(setting.seed)
        with contextlib.suppress(NextEpisode):
            played = run.play(
                job.start,
                np.random.default_rng(key),
                disturbance=setting.disturbance,
                draws=draw(scenario, key),
                progress=onlooker.look,
            )
            rows.append(played_row(played))
            onlooker.end(played)
    return {
        "played": len(rows),
        "successes": sum(row["success"] for row in rows),
        "skipped": len(jobs) - len(rows),
        "shoves": onlooker.shoves,
        "episodes": [told(row) for row in rows],
    }
