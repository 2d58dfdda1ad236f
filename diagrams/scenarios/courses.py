"""Where an unseen hand leads the cube: poses and speeds over time, nothing of physics.

A push leads it over the table, a slip along the pads of the hand that holds it, a yank out of that
hand and down onto the table. Frames: world W, cube O, gripper G (`models.task.spaces`).
"""

from dataclasses import dataclass

import numpy as np

from diagrams.scenarios.draws import REACH, Kind, Lead, within_reach
from models.rotations import rotation_vector_to_matrix, rotation_z
from models.task.spaces import REST_HEIGHT, Array

PUTTING = 0.25
"""Speed at which a yanked cube is put down [m/s]."""
SPARE = np.array([[0.02], [-0.02]])
"""By how much it is put within what can be reached, in x and y [m]."""
STEEPEST = 0.3
"""How much a yank may lead downwards, a share of its length: the table is near."""
INWARDS = 0.2
"""How much it may lead towards the palm, likewise."""


@dataclass(frozen=True)
class Moving:
    """Pose and speed of a frame in another.

    Attributes:
        R: orientation ``[3, 3]``.
        p: origin ``[3]`` [m].
        w: angular velocity ``[3]`` [rad/s].
        v: velocity of the origin ``[3]`` [m/s].
    """

    R: Array
    p: Array
    w: Array
    v: Array

    def seen_from(self, frame: "Moving") -> "Moving":
        """The same in a frame that moves itself."""
        Rt = frame.R.T
        p = self.p - frame.p
        v = self.v - frame.v - np.cross(frame.w, p)
        return Moving(Rt @ self.R, Rt @ p, Rt @ (self.w - frame.w), Rt @ v)

    def within(self, frame: "Moving") -> "Moving":
        """In the world, what this is in a frame that moves."""
        p = frame.R @ self.p
        v = frame.v + np.cross(frame.w, p) + frame.R @ self.v
        return Moving(frame.R @ self.R, frame.p + p, frame.w + frame.R @ self.w, v)


@dataclass(frozen=True)
class Course:
    """One lead from where it begins.

    Attributes:
        lead: what is done.
        R: the cube's orientation at the beginning, in the world for a push, else in the hand
            ``[3, 3]``.
        p: its centre, likewise ``[3]`` [m].
        direction: in which it is led, likewise ``[3]``.
        axis: about which it is turned, likewise ``[3]``.
    """

    lead: Lead
    R: Array
    p: Array
    direction: Array
    axis: Array

    def target(self, elapsed: float) -> Moving:
        """Where the cube should be, ``elapsed`` seconds after the beginning."""
        share = min(max(elapsed / self.lead.seconds, 0.0), 1.0)
        way = share * share * (3.0 - 2.0 * share)
        rate = 6.0 * share * (1.0 - share) / self.lead.seconds
        turn = self.lead.turn * self.axis
        along = self.lead.distance * self.direction
        R = rotation_vector_to_matrix(way * turn) @ self.R
        return Moving(R, self.p + way * along, rate * turn, rate * along)

    def went(self, now: Moving) -> tuple[float, float]:
        """How far the cube has come along the course and been turned [m], [rad]."""
        R = now.R @ self.R.T
        turned = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
        angle = np.arctan2(turned @ self.axis, (np.trace(R) - 1.0) / 2.0)
        return float((now.p - self.p) @ self.direction), float(angle)


def begin(lead: Lead, cube: Moving, hand: Moving) -> Course | None:
    """The course of a lead that begins now; None if there is no way to go.

    Args:
        lead: what is to be done.
        cube: where the cube is, in the world.
        hand: where the hand is, in the world.
    """
    if lead.kind == Kind.PUSH:
        for heading in lead.headings:
            direction = rotation_z(heading)[:, 0]
            if within_reach(cube.p + lead.distance * direction):
                return Course(lead, cube.R, cube.p, direction, np.array([0.0, 0.0, 1.0]))
        return None
    held = cube.seen_from(hand)
    ways = [np.array([np.cos(h), 0.0, np.sin(h)]) for h in lead.headings]
    if lead.kind == Kind.YANK:
        ways = [way for way in ways if _leads_out(lead, way, cube, hand)]
    else:
        # Towards the palm its corners would wedge the fingers apart.
        ways = [way for way in ways if way[2] >= 0.0]
    if not ways:
        return None
    return Course(lead, held.R, held.p, ways[0], np.array([0.0, 1.0, 0.0]))


def _leads_out(lead: Lead, way: Array, cube: Moving, hand: Moving) -> bool:
    """Whether a way out of the hand is no way to the palm, not far down, and ends in reach."""
    direction = hand.R @ way
    return (
        way[2] >= -INWARDS
        and direction[2] >= -STEEPEST
        and within_reach(cube.p + lead.distance * direction)
    )


def put_down(cube: Moving, elapsed: float) -> tuple[Moving, bool]:
    """A cube on its way to the table, in reach, ``elapsed`` seconds after it was pulled out.

    Args:
        cube: where it was then, in the world.
        elapsed: [s].

    Returns:
        Where it should be, however it turns, and whether it should have arrived.
    """
    down = np.array([*np.clip(cube.p[:2], *(REACH + SPARE)), REST_HEIGHT])
    way = down - cube.p
    seconds = max(float(np.linalg.norm(way)) / PUTTING, 1e-6)
    share = min(elapsed / seconds, 1.0)
    arrived = share == 1.0
    v = np.zeros(3) if arrived else way / seconds
    return Moving(cube.R, cube.p + share * way, np.zeros(3), v), arrived
