"""One call: a robot with its gripper as URDF, SRDF and MJCF."""

import os
from pathlib import Path

from models.errors import ModelError
from models.export.merged import merge
from models.export.mjcf import to_mjcf
from models.export.srdf import to_srdf
from models.export.urdf import to_urdf
from models.scenes.parsing import ARM
from models.scenes.postures import POSTURES

DIRECTIVES = {"gen3": "gen3_2f85.dmd.yaml", "gen3_lite": "gen3_lite.dmd.yaml"}
"""Directives of each arm with its gripper, without table and cube."""


def export_robot(folder: Path | str, robot: str = "gen3") -> tuple[Path, Path, Path]:
    """Write an arm with its gripper as files that need no other: no meshes, no packages.

    Names of links and joints are those of `models/description`. The root is the arm's base B, on
    which no world is assumed (the scenes' base stands at (0, 0, 0.5) m), and ``tcp`` is frame G.

    * URDF 1.0 with cylinders and spheres for capsules, ``<mimic>`` fingers and a transmission on
      every joint that is commanded;
    * SRDF with the pairs of links that we never compare, and the vendor's named postures;
    * MJCF with capsules, couplers, a torque motor on every actuated joint and the same pairs.

    Args:
        folder: where to write; made if it is not there. Files of the same names are replaced.
        robot: ``gen3`` or ``gen3_lite``.

    Returns:
        The files: URDF, SRDF, MJCF.

    Raises:
        ModelError: if there is no such robot, or the folder cannot be written to.
    """
    if robot not in DIRECTIVES:
        raise ModelError(f"robot {robot!r}; valid: {', '.join(DIRECTIVES)}")
    merged = merge(DIRECTIVES[robot])
    texts = (to_urdf(merged), to_srdf(merged, ARM, POSTURES[robot]), to_mjcf(merged))
    folder = Path(folder)
    urdf, srdf, mjcf = (folder / f"{merged.name}.{kind}" for kind in ("urdf", "srdf", "xml"))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in zip((urdf, srdf, mjcf), texts, strict=True):
            unfinished = path.with_name(f".{path.name}.{os.getpid()}")
            unfinished.write_text(text, encoding="utf-8")
            unfinished.replace(path)
    except OSError as error:
        raise ModelError(
            f"{folder}: {error.strerror}; valid: a folder that can be written to"
        ) from error
    return urdf, srdf, mjcf
