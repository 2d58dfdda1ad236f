"""The robots: their description, kinematics and motions, and the task's states without a robot.

The rooms, in reading order; each knows only those above it, and `task.spaces`:

* `models.scenes`: the description files as Drake plants, the two arms with their hands, and the
  `PlanningScene`, which answers where the hand is and what it is near to;
* `models.gen3`: the Gen3's arithmetic, compiled: its chain, its inverse kinematics in closed form,
  capsules about its links;
* `models.gen3_lite`: all solutions of the Gen3 Lite, by a polynomial of degree 16;
* `models.inverse_kinematics`: joint angles for a pose of the hand, verified and collision-free;
* `models.maps`: reachability maps of both arms, and the workspace map;
* `models.motion`: paths that are proved free, their timing, and the plans of the task's actions;
* `models.task`: the grasping task's 15,984 states and 55 actions, and what follows from geometry
  alone; it knows none of the other rooms;
* `models.export`: the arms with their grippers as URDF, SRDF and MJCF, for other tools; no other
  room knows it.

Beside them `models.rotations` (every notation of the thesis), `models.printed` (rotation matrices
as logs print them), `models.dh` (Denavit–Hartenberg parameters, as a second opinion),
`models.compiled` (numba, with a cache that watches the functions that are called),
`models.arrays` (numbers from users, looked at before anything computes with them),
`models.texts` (so too for their text files) and `models.errors`.

What a user of the robots wants is handed on here and loads on first use. For example::

    from models import HOME, IkSolver, PlanningScene, plan_path, time_path

    scene = PlanningScene()
    answer = IkSolver(scene).solve(X_WG)  # a pose of the tool centre point
    if answer.q is None:
        raise SystemExit(answer.reason())
    path = plan_path(scene, HOME, answer.q)  # None if no straight path is free
    motion = time_path(path, scene.velocity_limit)

``python -m models`` opens a robot in Drake's model visualizer; with ``--export DIR`` it writes the
robot's files in place of that.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from models.errors import ModelError

if TYPE_CHECKING:
    from models.export.files import export_robot
    from models.inverse_kinematics.solution import Failure, IkSolution
    from models.inverse_kinematics.solver import IkSolver, solve
    from models.maps.reachability import ReachabilityMap
    from models.maps.reachability_csv import read_map
    from models.motion.paths import PathPlanner, plan_path
    from models.motion.planner import ActionPlanner
    from models.motion.timing import time_path
    from models.printed import renormalised
    from models.scenes.parsing import add_models, strict_parser
    from models.scenes.planning_scene import HOME, PlanningScene
    from models.scenes.postures import posture
    from models.scenes.robots import GEN3, GEN3_LITE, Robot
    from models.scenes.setup import Obstacle, Setup, Tool, read_setup
    from models.scenes.tool_frame import gripper_to_tool, tool_to_gripper
    from models.task.spaces import Action, State

__all__ = [
    "GEN3",
    "GEN3_LITE",
    "HOME",
    "Action",
    "ActionPlanner",
    "Failure",
    "IkSolution",
    "IkSolver",
    "ModelError",
    "Obstacle",
    "PathPlanner",
    "PlanningScene",
    "ReachabilityMap",
    "Robot",
    "Setup",
    "State",
    "Tool",
    "add_models",
    "export_robot",
    "gripper_to_tool",
    "plan_path",
    "posture",
    "read_map",
    "read_setup",
    "renormalised",
    "solve",
    "strict_parser",
    "time_path",
    "tool_to_gripper",
]

_HOMES = {
    "models.export.files": ("export_robot",),
    "models.inverse_kinematics.solution": ("Failure", "IkSolution"),
    "models.inverse_kinematics.solver": ("IkSolver", "solve"),
    "models.maps.reachability": ("ReachabilityMap",),
    "models.maps.reachability_csv": ("read_map",),
    "models.motion.paths": ("PathPlanner", "plan_path"),
    "models.motion.planner": ("ActionPlanner",),
    "models.motion.timing": ("time_path",),
    "models.printed": ("renormalised",),
    "models.scenes.parsing": ("add_models", "strict_parser"),
    "models.scenes.planning_scene": ("HOME", "PlanningScene"),
    "models.scenes.postures": ("posture",),
    "models.scenes.robots": ("GEN3", "GEN3_LITE", "Robot"),
    "models.scenes.setup": ("Obstacle", "Setup", "Tool", "read_setup"),
    "models.scenes.tool_frame": ("gripper_to_tool", "tool_to_gripper"),
    "models.task.spaces": ("Action", "State"),
}


def __getattr__(name: str) -> Any:
    """Load a name of `__all__` from where it is defined."""
    for module, names in _HOMES.items():
        if name in names:
            value = globals()[name] = getattr(import_module(module), name)
            return value
    raise AttributeError(f"module 'models' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
