"""Drake systems: the robot's cell, its controllers, a policy in closed loop, and trials.

The rooms, in reading order:

* `station`: the robot cell as one diagram, the ports that a controller sees;
* `arm_controller`, `gripper_controller`, `limiter`, `reference_ramp`: commands to joints;
* `hand_mount`: how the hand sits on the arm, and why;
* `state_identifier`: measured poses to the index of a state;
* `action_executor`: a requested action to commands, planned, timed and watched;
* `execution`: the phases of an action, what is watched in each, and how one brakes;
* `decisions`: which action to take, by a policy's table, by a forecast from the true pose, or told;
* `policy_controller`: what is seen to requests for actions, by a decision;
* `policy_run`: all of that in one diagram, an episode simulated;
* `scenarios`: episodes in which things go otherwise, pushed, pulled, noisy, late;
* `monitor`: what the robot did at most, compared with its limits, and how deep contacts were;
* `state_view`: a state posed by hand, and how an action would be carried out;
* `camera`: still pictures of the cell;
* `contact`: how contact is simulated wherever the gripper meets the cube;
* `falls`: how a cube that nothing holds lands, blow by blow;
* `faults`: failures of the simulator, told apart from ours;
* `trials`: one action tried with noise, as often as a plan wants; the database; what many tell.

``from diagrams import Station`` is the way in; it loads Drake on first use.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diagrams.station import Station

__all__ = ["Station"]


def __getattr__(name: str) -> Any:
    """Load a name of `__all__` when it is first asked for."""
    if name == "Station":
        from diagrams.station import Station  # noqa: PLC0415 - as late as can be

        return Station
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
