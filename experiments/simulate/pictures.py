"""What a person sees of episodes: a recording, film strips, a moving picture, a portrait."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imsave
from PIL import Image

from diagrams.camera import StillCamera
from diagrams.policy_run import Played
from diagrams.scenarios.scene_changes import change_scene
from diagrams.scenarios.schema import parse_scenario
from diagrams.station import FRAME
from experiments.kit.command import Output
from experiments.kit.recording import CHOSEN, write_recording
from models.task import words

STRIDE = 4
"""Of so many pictures of an episode a moving one has one."""
SPEED = 2.0
"""How much faster than the simulation it is."""
COLOURS = 128
VIVID = 110
"""Difference between the channels of a pixel that is of the cube."""
NEAR = np.array([0.20, -0.27, 0.17])
"""From the cube to a film strip's camera [m]."""


def leave_pictures(
    played: Sequence[Played], titles: Sequence[str], goal: int, scenario: str, output: Output
) -> None:
    """Leave a recording of all, a film strip of each, and the first one as a moving picture.

    ``recording.html``, ``episode_N.png``, ``episode.gif``, and ``robot.png``, the scene after the
    first action.

    Args:
        played: episodes.
        titles: what each is called.
        goal: index of the state that is the goal.
        scenario: YAML of what went otherwise; empty for nothing.
        output: folder of the pictures.
    """
    prepare = partial(change_scene, parse_scenario(scenario, "scenario")) if scenario else None
    with output.file("recording.html") as path:
        write_recording(path, played, titles, goal, prepare)
    camera = StillCamera(prepare=prepare, size=(480, 360))
    for number, (episode, title) in enumerate(zip(played, titles, strict=True), 1):
        with output.figure(f"episode_{number}.png", dpi=90) as figure:
            draw_film_strip(figure, episode, title, camera)
    wide = StillCamera(prepare=prepare, size=(560, 400))
    with output.file("episode.gif") as path:
        write_gif(path, played[0], wide)
    if len(played[0].postures) > 1:
        portrait = StillCamera(prepare=prepare, size=(1280, 860))
        portrait.look((1.15, -0.62, 1.0), (0.33, 0.0, 0.74))
        with output.file("robot.png") as path:
            imsave(path, portrait.picture(played[0].postures[1]))


def draw_film_strip(figure: Figure, played: Played, title: str, camera: StillCamera) -> None:
    """Draw the cube at the start and after each action, from near by, in a person's words."""
    steps = played.episode.steps
    titles = [f"start: {words.describe_state(played.start)}".replace("; ", ";\n")]
    for number, step in enumerate(steps, 1):
        told = step.failure.value if step.failure else CHOSEN[step.chosen_by]
        titles.append(f"{number}. {words.describe_action(step.action)}\n({told})")
    shown = played.postures[: len(titles)]
    columns = min(4, len(shown))
    rows = -(-len(shown) // columns)
    figure.set_size_inches(4 * columns, 3.5 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for axis, posture, text in zip(axes.flat, shown, titles, strict=False):
        cube = camera.cube(posture)
        camera.look(cube + NEAR, cube)
        axis.imshow(camera.picture(posture))
        axis.set_title(text, fontsize=9)
    many = "1 action" if len(steps) == 1 else f"{len(steps)} actions"
    said = "the goal is reached" if played.success else played.reason or played.episode.verdict
    figure.suptitle(f"{title}: {said} after {many}")


def write_gif(path: Path, played: Played, camera: StillCamera) -> None:
    """Write an episode as a moving picture that every browser shows."""
    camera.look((1.1, -0.72, 1.02), (0.36, 0.0, 0.71))
    frames = [*played.frames[::STRIDE], *[played.frames[-1]] * 6]
    pictures = [Image.fromarray(camera.picture(frame)) for frame in frames]
    # One palette for all, so that only what moves differs from one to the next. The cube is small
    # and its colours are what counts: they get a share of the palette that is theirs.
    some = [np.asarray(each).reshape(-1, 3) for each in pictures[:: max(1, len(pictures) // 8)]]
    pixels = np.concatenate(some)
    vivid = pixels[np.ptp(pixels, axis=1) > VIVID]
    if vivid.size:
        pixels = np.concatenate([pixels, np.resize(vivid, pixels.shape)])
    palette = Image.fromarray(pixels[None]).quantize(COLOURS, dither=Image.Dither.NONE)
    pictures = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in pictures]
    milliseconds = round(1e3 * STRIDE * FRAME / SPEED)
    pictures[0].save(
        path,
        format="GIF",
        save_all=True,
        append_images=pictures[1:],
        duration=milliseconds,
        loop=0,
        optimize=True,
    )
