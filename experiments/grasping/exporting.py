"""Played episodes as files for a real arm: joint trajectories, and when the gripper closes."""

from collections.abc import Sequence
from pathlib import Path

from diagrams.policy_controller import SETTLE
from diagrams.policy_run import Played
from irl.errors import InputError
from irl.files import atomic_path
from models.errors import ModelError
from models.export.precomputed import require_precomputed_text, to_precomputed
from models.export.trajectories import grips_to_csv, time_program, to_csv, to_ros
from models.motion.moves import Grip, Move
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME

FORMS = {"trajectory.csv": to_csv, "trajectory.yaml": to_ros, "gripper.csv": grips_to_csv}
PRECOMPUTED = "precomputed.csv"


def program(played: Played) -> list[Move | Grip]:
    """What the arm did one after another, with a rest before and after each action."""
    width = MAX_OPENING
    parts: list[Move | Grip] = [Grip(width, SETTLE)]
    for plan in played.plans:
        for part in plan:
            parts.append(part)
            width = part.width if isinstance(part, Grip) else width
        parts.append(Grip(width, SETTLE))
    return parts


def export_episodes(folder: Path, played: Sequence[Played], speed_limit: float) -> list[str]:
    """Write each episode into a folder of its own: ``episode_1/trajectory.csv`` and so on.

    Args:
        folder: made if it is missing; files of the same names are replaced.
        played: episodes; those that the simulator failed in are left out, and those in which an
            action was ended on its way.
        speed_limit: of every joint, that the motions are timed for anew [deg/s].

    Returns:
        Names of the episodes' folders.

    Raises:
        InputError: if a folder cannot be written.
        ModelError: if an episode's motion breaks a rule of `models.export.precomputed`.
    """
    written = []
    for number, episode in enumerate(played, 1):
        ended = any(step.failure and not step.stood for step in episode.episode.steps)
        if episode.fault or ended:
            continue
        name = f"episode_{number}"
        motion = time_program(HOME, MAX_OPENING, program(episode), speed_limit)
        precomputed = to_precomputed(motion)
        try:
            require_precomputed_text(precomputed, f"{folder / name / PRECOMPUTED}", HOME)
        except ModelError as error:
            raise ModelError(f"the arm would refuse this episode: {error}") from error
        texts = {file: form(motion) for file, form in FORMS.items()} | {PRECOMPUTED: precomputed}
        try:
            (folder / name).mkdir(parents=True, exist_ok=True)
            for file, text in texts.items():
                with atomic_path(folder / name / file) as path:
                    path.write_text(text)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be written ({error.strerror})", place="--export"
            ) from error
        written.append(name)
    return written
