"""Shipped data and how they are read: the robot's reachability map and feasible actions."""

from dataclasses import fields
from functools import cache
from pathlib import Path

import numpy as np

from irl.files import sha256
from irl.npz import read_npz, write_npz
from models.errors import ModelError
from models.maps.reachability_csv import read_map
from models.motion.feasibility import Feasibility
from models.motion.planner import ActionPlanner

DATA = Path(__file__).parents[1] / "data"
SHIPPED_TASK = DATA / "grasp"
"""Task data of the grasping task, made by ``experiments.transitions``."""
SHIPPED_TRIALS = DATA / "trials.db"
"""Database of the trials that the task data come from, made by the same."""
SHIPPED_ROBOT = DATA / "gen3"
"""Reachability map and feasible actions, made by ``experiments.reachability``."""
MAP, FEASIBILITY = "map.csv", "feasibility.npz"


def load_planner(folder: Path = SHIPPED_ROBOT) -> ActionPlanner:
    """Planner on the map of a folder.

    Raises:
        ModelError: if the map is missing, malformed, or made from other model files.
    """
    return ActionPlanner(read_map(folder / MAP))


def save_feasibility(feasibility: Feasibility, map_file: Path, path: Path) -> None:
    """Write feasible actions with the hash of the map that they were planned on."""
    arrays = {field.name: getattr(feasibility, field.name) for field in fields(feasibility)}
    digest = np.frombuffer(bytes.fromhex(sha256(map_file)), dtype=np.uint8)
    write_npz(path, {**arrays, "map_sha256": digest})


@cache
def load_feasibility(folder: Path = SHIPPED_ROBOT) -> Feasibility:
    """Feasible actions of a folder.

    Raises:
        ModelError: if the file is missing, malformed, or planned on another map.
    """
    path = folder / FEASIBILITY
    if not path.is_file():
        raise ModelError(f"{path}: no such file; make it with 'python -m experiments.reachability'")
    arrays = read_npz(path)
    names = [field.name for field in fields(Feasibility)]
    for name in (*names, "map_sha256"):
        if name not in arrays:
            raise ModelError(f"{path}: field '{name}' is missing; wanted {', '.join(names)}")
    if arrays.pop("map_sha256").tobytes().hex() != sha256(folder / MAP):
        raise ModelError(
            f"{path}: field 'map_sha256' is of another {MAP}; "
            "remake both with 'python -m experiments.reachability'"
        )
    return Feasibility(**{name: arrays[name] for name in names})
