"""The same cubes held by robosuite's 2F-85 in MuJoCo, in an environment of its own."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from experiments.bench.comparison import ROOT, Peers
from experiments.hold.cases import Case, columns
from experiments.hold.held import AFTER, GONE, LOOK, SETTLE, judge
from models.task.spaces import CUBE_EDGE

SCRIPT = Path(__file__).parent / "peers" / "robosuite_hold.py"
PYTHON = ROOT / ".venv-robosuite" / "bin" / "python"
TIME_STEP = 0.002
"""robosuite's own [s]."""
_HAS = "import importlib.util, mujoco, sys; sys.exit(importlib.util.find_spec('robosuite') is None)"


def missing(python: Path) -> str:
    """Why the comparison is left out; empty if it need not be.

    Args:
        python: interpreter of the environment that has robosuite.
    """
    remedy = "`make hold` builds one"
    if not python.is_file():
        return f"{python}: no such interpreter; {remedy}"
    done = subprocess.run([python, "-c", _HAS], capture_output=True, check=False)
    return f"{python}: has no robosuite with MuJoCo; {remedy}" if done.returncode else ""


def hold_all(python: Path, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Hold the cube in every case.

    Args:
        python: interpreter of the environment that has robosuite.
        cases: at least one.

    Returns:
        Columns of each case's row, named ``mujoco_…``.
    """
    motions = [case.motion for case in cases]
    count = np.array([len(motion.time) for motion in motions])
    answer = Peers(python).run(
        str(SCRIPT),  # a whole path stays as it is
        edge=np.array(CUBE_EDGE),
        time_step=np.array(TIME_STEP),
        settle_s=np.array(SETTLE),
        after_s=np.array(AFTER),
        look_s=np.array(LOOK),
        gone=np.array(GONE),
        time=np.concatenate([motion.time for motion in motions]),
        felt=np.concatenate([motion.felt_G for motion in motions]),
        first=np.cumsum(count) - count,
        count=count,
        mass=np.array([case.load.mass for case in cases]),
        friction=np.array([case.load.friction for case in cases]),
        force=np.array([case.load.force for case in cases]),
    )
    rows, first = [], 0
    for looks in answer["looks"]:
        seen = slice(first, first + int(looks))
        poses = [
            RigidTransform(Quaternion(pose[3:] / np.linalg.norm(pose[3:])), pose[:3])
            for pose in answer["pose"][seen]
        ]
        held = judge(poses, answer["speed"][seen], answer["pad_force"][seen])
        rows.append(columns(held, "mujoco_"))
        first = seen.stop
    return rows
