"""How hard an episode drives the arm: what its joints did at most, compared with their limits."""

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import LogVectorOutput

from diagrams.arm_controller import JOINTS
from diagrams.station import Station
from models.scenes.parsing import ARM


@dataclass(frozen=True)
class Loads:
    """What the arm's joints did at most.

    Attributes:
        speed: largest share of the speed limit ``[7]``.
        torque: largest share of the torque limit ``[7]``, what carries the arm's weight included.
        tracking_error: largest distance from the command ``[7]`` [rad].
        limited_samples: how many commands were beyond a limit, and not followed as they were.
    """

    speed: np.ndarray
    torque: np.ndarray
    tracking_error: np.ndarray
    limited_samples: int


class LoadMeter:
    """Logs a station's arm at every step, by Drake's own loggers, and reads the logs."""

    def __init__(self, builder: DiagramBuilder, station: Station, command: OutputPort) -> None:
        """Attach to ``station``, whose arm obeys ``command``; both are in ``builder``."""
        plant = station.plant
        self._station = station
        self._speed, self._torque = _limits(plant)
        period = plant.time_step()
        ports = {
            name: station.GetOutputPort(f"arm.{name}_measured")
            for name in ("position", "velocity", "torque")
        }
        self._logs = {
            name: LogVectorOutput(port, builder, publish_period=period)
            for name, port in {**ports, "command": command}.items()
        }

    def read(self, root: Context) -> Loads:
        """What was logged in a simulation of ``root``'s diagram so far."""
        log = {name: sink.FindLog(root).data() for name, sink in self._logs.items()}
        samples = self._station.GetOutputPort("arm.limited_samples")
        return Loads(
            speed=_largest(log["velocity"]) / self._speed,
            torque=_largest(log["torque"]) / self._torque,
            tracking_error=_largest(log["position"] - log["command"]),
            limited_samples=int(samples.Eval(self._station.GetMyContextFromRoot(root))[0]),
        )


def _limits(plant: MultibodyPlant) -> tuple[np.ndarray, np.ndarray]:
    """Of the arm's speed [rad/s] and torque [N m], ``[7]`` each."""
    arm = plant.GetModelInstanceByName(ARM)
    speed = [plant.GetJointByName(name, arm).velocity_upper_limits()[0] for name in JOINTS]
    torque = [plant.GetJointActuatorByName(name, arm).effort_limit() for name in JOINTS]
    return np.array(speed), np.array(torque)


def _largest(values: np.ndarray) -> np.ndarray:
    """Largest size of each row; 0 of an empty one."""
    return np.abs(values).max(axis=1, initial=0.0)
