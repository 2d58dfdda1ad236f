"""Episodes as a page that plays them: with captions, the goal, and a camera that keeps up.

The page is one file, which needs no server and no network. It is made from what was played, so that
playing does not depend on being recorded.
"""

import json
import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.geometry import Box, Meshcat, MeshcatParams, MeshcatVisualizer, Rgba
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from diagrams.decisions import By
from diagrams.hand_mount import HandMount
from diagrams.policy_run import Played
from diagrams.station import FRAME
from models.scenes.parsing import CUBE
from models.task import words
from models.task.spaces import CUBE_EDGE, POSITIONS, R_WO, REST_HEIGHT, decode_states

PAUSE = 1.0
"""How long the last scene of an episode stands [s]."""
MOST_FRAMES = 2500
"""In a recording; of longer ones only every second or third picture is kept, and so on."""
VIEW = np.array([0.46, -0.58, 0.32])
"""From what is looked at to the camera [m]."""
SMOOTH = 0.6
"""How fast the camera follows: the time constant [s]."""
CHOSEN = {
    By.POLICY: "as the policy says",
    By.FORECAST: "by forecast, in place of the policy's",
    By.UNTRIED: "not tried here yet",
    By.RELEASE: "to free a cube that is clamped",
    By.PERSON: "as a person asks",
}
"""What chose an action, in words."""
_OVERLAY = """
<div id="caption" style="position:fixed;left:0;right:0;bottom:0;padding:14px 22px;
 background:rgba(20,24,30,.78);color:#fff;font:17px/1.45 system-ui,sans-serif;white-space:pre-line;
 pointer-events:none;z-index:9"></div>
<script>
(function () {
  const told = __CAPTIONS__, focus = __FOCUS__, step = __STEP__;
  const box = document.getElementById("caption");
  let before = focus[0];
  function show() {
    const t = viewer.animator.time;
    let text = told[0][1];
    for (const [since, words] of told) { if (since <= t + 1e-9) text = words; }
    if (box.textContent !== text) box.textContent = text;
    const now = focus[Math.min(Math.floor(t / step), focus.length - 1)];
    if (now !== before) {
      // The camera's own coordinates have y upwards. Where a person has turned it, it stays.
      const by = [now[0] - before[0], now[2] - before[2], before[1] - now[1]];
      for (const each of [viewer.camera.position, viewer.controls.target]) {
        each.x += by[0]; each.y += by[1]; each.z += by[2];
      }
      before = now;
      viewer.set_dirty();
    }
    requestAnimationFrame(show);
  }
  show();
})();
</script>
"""


@dataclass(frozen=True)
class Caption:
    """What is told from a moment on.

    Attributes:
        since: seconds from the recording's beginning.
        text: lines.
    """

    since: float
    text: str


def captions(played: Played, title: str) -> list[Caption]:
    """What is told of an episode, from its own beginning: the start, each action, the result."""
    told = [Caption(0.0, f"{title}\nstart: {words.describe_state(played.start)}")]
    for number, step in enumerate(played.episode.steps, 1):
        action = f"{number}. {words.describe_action(step.action)} ({CHOSEN[step.chosen_by]})"
        told.append(Caption(step.started, f"{title}\n{action}"))
        after = step.failure or words.describe_state(step.next_state)
        told.append(Caption(step.ended, f"{title}\n{action}\n→ {after}"))
    many = len(played.episode.steps)
    said = "the goal is reached" if played.success else played.reason or played.episode.verdict
    last = f"{title}\n{said}, after {many} action{'s' * (many != 1)}"
    told.append(Caption(max(played.seconds, told[-1].since), last))
    return told


class Stage:
    """The station's models without physics, for pictures of what was played."""

    def __init__(self, prepare: Callable[[MultibodyPlant], None] | None, meshcat: Meshcat) -> None:
        """Show the models on ``meshcat``, changed by ``prepare`` as the station's were."""
        builder = DiagramBuilder()
        self._plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        HandMount(self._plant)
        if prepare is not None:
            prepare(self._plant)
        self._plant.Finalize()
        self.visualizer = MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self._context = self._plant.GetMyMutableContextFromRoot(self._root)
        self._cube = self._plant.GetBodyByName(CUBE)
        self._tcp = self._plant.GetFrameByName("tcp")

    def show(self, positions: np.ndarray, time: float) -> np.ndarray:
        """Show positions ``[n_q]`` at a time [s]; what to look at then, a point ``[3]`` [m]."""
        self._root.SetTime(time)
        self._plant.SetPositions(self._context, positions)
        self._diagram.ForcedPublish(self._root)
        cube = self._cube.EvalPoseInWorld(self._context).translation()
        hand = self._tcp.CalcPoseInWorld(self._context).translation()
        return 0.6 * cube + 0.4 * hand


def goal_pose(goal: int) -> RigidTransform:
    """Where the cube lies in a free state, or is held in another."""
    position, orientation, hand = decode_states(goal)
    p = POSITIONS[int(position)].copy()
    if hand < 0:
        p[2] = REST_HEIGHT
    return RigidTransform(RotationMatrix(R_WO[int(orientation)]), p)


def show_goal(meshcat: Meshcat, goal: int) -> None:
    """Show a translucent cube where it is in a state."""
    meshcat.SetObject("goal", Box(*[1.02 * CUBE_EDGE] * 3), Rgba(0.1, 0.75, 0.35, 0.35))
    meshcat.SetTransform("goal", goal_pose(goal))


def write_recording(
    path: Path,
    played: Sequence[Played],
    titles: Sequence[str],
    goal: int,
    prepare: Callable[[MultibodyPlant], None] | None = None,
) -> None:
    """Write a page that plays episodes one after another.

    Args:
        path: an HTML file.
        played: the episodes.
        titles: what each is called.
        goal: index of the state that a translucent cube shows.
        prepare: what changed the station's plant, if anything did.
    """
    logging.getLogger("drake").setLevel(logging.WARNING)
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    show_goal(meshcat, goal)
    stage = Stage(prepare, meshcat)
    stride = -(-sum(len(each.frames) for each in played) // MOST_FRAMES)
    meshcat.StartRecording(
        frames_per_second=1.0 / (stride * FRAME), set_visualizations_while_recording=False
    )
    time, told, looked = 0.0, list[Caption](), list[np.ndarray]()
    for episode, title in zip(played, titles, strict=True):
        told += [Caption(time + each.since, each.text) for each in captions(episode, title)]
        for positions in _kept(episode.frames, stride):
            looked.append(stage.show(positions, time))
            time += stride * FRAME
        # The last scene stands, and nothing glides from it to the next episode.
        still = round(PAUSE / (stride * FRAME))
        time += (still - 1) * stride * FRAME
        looked += [stage.show(episode.frames[-1], time)] * still
        time += stride * FRAME
    meshcat.StopRecording()
    meshcat.PublishRecording()
    focus = _followed(np.array(looked), stride * FRAME)
    meshcat.SetCameraPose(focus[0] + VIEW, focus[0])
    overlay = (
        _OVERLAY.replace("__CAPTIONS__", json.dumps([[c.since, c.text] for c in told]))
        .replace("__FOCUS__", json.dumps(focus.round(3).tolist()))
        .replace("__STEP__", repr(stride * FRAME))
    )
    page, end = meshcat.StaticHtml(), "</body>"
    before, _, after = page.rpartition(end)
    path.write_text(f"{before}{overlay}{end}{after}", encoding="utf-8")


def _kept(frames: np.ndarray, stride: int) -> Iterator[np.ndarray]:
    """Every so manyth picture, and the last."""
    yield from frames[:-1:stride]
    yield frames[-1]


def _followed(looked: np.ndarray, period: float) -> np.ndarray:
    """What is looked at, smoothed both ways so that the camera neither lags nor trembles."""
    rate = 1.0 - np.exp(-period / SMOOTH)
    for _ in range(2):
        smooth = looked.copy()
        for i in range(1, len(smooth)):
            smooth[i] = smooth[i - 1] + rate * (looked[i] - smooth[i - 1])
        looked = smooth[::-1]
    return looked
