"""The same swings by the whole arm, in the station, with either step; and a recording."""

import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from diagrams.contact import set_cube_mass, set_friction
from diagrams.faults import simulating
from diagrams.station import FRAME, TIME_STEP, Station
from experiments.hold.cases import Case
from experiments.hold.held import SETTLE
from experiments.hold.rig import Load, hold, looks
from experiments.hold.swings import Motion
from models.scenes.parsing import CUBE
from models.task.spaces import CUBE_EDGE

_ASIDE = np.array([np.pi / 2, *[0.0] * 6])  # a hand that hangs down would hit the table [rad]
_PAUSE = 0.4  # between two swings of a recording [s]
_TIGHT = 1e-5  # by which the pads overlap the cube at the start, so that it does not fall [m]


class SwingingArm:
    """A station whose arm follows swings, its hand shut on the cube.

    ::

       swing ──── TrajectorySource ─┐
                                    ├── Station
       opening ── constant, shut ───┘
    """

    def __init__(self, force: float, time_step: float, meshcat: Meshcat | None = None) -> None:
        """Build it.

        Args:
            force: of each pad [N].
            time_step: of the station [s].
            meshcat: where to show it; None does not.
        """
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem(
            "station", Station(meshcat=meshcat, time_step=time_step, grip_force=force)
        )
        self._way = builder.AddSystem(TrajectorySource(PiecewisePolynomial(np.zeros(7))))
        shut = builder.AddSystem(ConstantVectorSource([0.0]))
        for source, name in ((self._way, "arm"), (shut, "gripper")):
            port = self.station.GetInputPort(f"{name}.position_command")
            builder.Connect(source.get_output_port(), port)
        self.simulator = Simulator(builder.Build())

    def swing(self, motion: Motion, load: Load, start: float = 0.0) -> tuple[np.ndarray, int]:
        """Swing once.

        Args:
            motion: what the arm is told to do.
            load: cube and friction; the force is the station's.
            start: time that it begins at [s].

        Returns:
            Where the cube's centre is in the hand, less where it was before the swing ``[n, 3]``
            [m]; and how many samples of the command were limited.

        Raises:
            SimulatorFault: if the solver fails.
        """
        station, plant = self.station, self.station.plant
        root = self.simulator.get_mutable_context()
        root.SetTime(start)
        self._way.UpdateTrajectory(joint_way(motion, start + SETTLE))
        context = plant.GetMyMutableContextFromRoot(root)
        set_friction(plant, station.scene_graph, root, load.friction)
        set_cube_mass(plant, context, load.mass)
        plant.SetVelocities(context, np.zeros(plant.num_velocities()))
        away = RigidTransform([0.0, 0.0, 2.0])
        station.initialize(root, X_WO=away, q=motion.q[0] + _ASIDE, width=CUBE_EDGE - _TIGHT)
        tcp, cube = plant.GetFrameByName("tcp"), plant.GetBodyByName(CUBE)
        plant.SetFreeBodyPose(context, cube, tcp.CalcPoseInWorld(context))
        limited = station.GetOutputPort("arm.limited_samples")
        seen = []
        with simulating():
            self.simulator.Initialize()
            for time in start + looks(motion):
                self.simulator.AdvanceTo(time)
                X_GW = tcp.CalcPoseInWorld(context).inverse()
                seen.append((X_GW @ cube.EvalPoseInWorld(context)).translation())
        count = int(limited.Eval(station.GetMyContextFromRoot(root))[0])
        return np.array(seen) - seen[0], count


def joint_way(motion: Motion, begins: float) -> PiecewisePolynomial:
    """The joints' way through a swing that begins at a time [s], aside of the table."""
    way = (motion.q + _ASIDE).T
    return PiecewisePolynomial.CubicHermite(begins + motion.time, way, motion.v.T)


def compare(case: Case, time_step: float) -> dict[str, Any]:
    """A swing by the whole arm, with its step and with half of it, beside the hand on slides.

    Displacements are of the cube's centre in the hand, once the swing is over.

    Args:
        case: which swing, and of what.
        time_step: of the hand on slides [s].
    """
    motion, load = case.motion, case.load
    alone = hold(motion, load, time_step)
    steps = (TIME_STEP, TIME_STEP / 2)
    found = [SwingingArm(load.force, step).swing(motion, load) for step in steps]
    off, halved = (1e3 * way[-1] for way, _ in found)
    return {
        "swing": case.swing,
        "slides_slip_mm": 1e3 * alone.slip,
        "displacement_mm": float(np.linalg.norm(off)),
        "halved_displacement_mm": float(np.linalg.norm(halved)),
        "limited_samples": [limited for _, limited in found],
    }


def record(cases: Sequence[Case], path: Path, progress: Callable[[], object]) -> None:
    """Record swings by the whole arm, one after the other, as one HTML page.

    Args:
        cases: all with the same grip force.
        path: page to write.
        progress: called after each.
    """
    logging.getLogger("drake").setLevel(logging.WARNING)  # the server's address is of no use here
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    meshcat.SetCameraPose([1.6, -1.5, 1.4], [0.5, 0.0, 0.75])
    arm = SwingingArm(cases[0].load.force, TIME_STEP, meshcat)
    meshcat.StartRecording(
        frames_per_second=round(1.0 / FRAME), set_visualizations_while_recording=False
    )
    start = 0.0
    for case in cases:
        arm.swing(case.motion, case.load, start)
        start = arm.simulator.get_context().get_time() + _PAUSE
        progress()
    meshcat.StopRecording()
    meshcat.PublishRecording()
    path.write_text(meshcat.StaticHtml(), encoding="utf-8")
