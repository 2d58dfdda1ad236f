"""Where an unseen hand leads the cube: poses and speeds over time, nothing of physics.

A push leads it over the table, a slip along the pads of the hand that holds it, a yank out of that
hand, beside it and down onto the table. Frames: world W, cube O, gripper G (`models.task.spaces`).
"""

from dataclasses import dataclass, replace

import numpy as np

from diagrams.scenarios.draws import REACH, Kind, Lead, within_reach
from models.rotations import rotation_vector_to_matrix, rotation_z
from models.task.spaces import CUBE_EDGE, REST_HEIGHT, TABLE_TOP, Array

PUTTING = 0.25
"""Speed at which a yanked cube is put down [m/s]."""
SPARE = np.array([[0.02], [-0.02]])
"""By how much it is put within what can be reached, in x and y [m]."""
ASIDE = 0.11
"""How far beside the hand it is put, from above [m]: half the hand's width and half the cube's."""
HAND = 0.2
"""From the tool centre point to the wrist [m]."""
_APART = 0.01
"""Between two places among which is chosen [m]."""
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

    def above_table(self, R: Array) -> "Moving":
        """The same, raised where a cube of orientation ``R`` would be in the table there."""
        least = TABLE_TOP + CUBE_EDGE / 2.0 * float(np.abs(R[2]).sum())
        if self.p[2] >= least:
            return self
        v = [*self.v[:2], max(self.v[2], 0.0)]
        return replace(self, p=np.array([*self.p[:2], least]), v=np.array(v))


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


def place_aside(cube: Moving, hand: Moving) -> Array:
    """Where to put a cube that was pulled out of a hand, so that the hand is not between.

    Args:
        cube: where it is, in the world.
        hand: where the hand is, in the world.

    Returns:
        x and y ``[2]`` [m], in reach and `ASIDE` of the hand, or as far as there is; of such places
        one that the way to leads least near to the hand, and of these the nearest.
    """
    low, high = REACH + SPARE
    x, y = (np.arange(low[i], high[i] + 1e-9, _APART) for i in range(2))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    here = cube.p[:2]
    shares = np.linspace(0.0, 1.0, 11)[:, None, None]
    # Each place's way, point by point ``[11, n]``, and how far beside the hand it is there.
    beside = _beside(here + shares * (places - here), hand)
    aside = beside[-1] >= min(ASIDE, beside[-1].max())
    spare = np.minimum(beside.min(axis=0), min(beside[0, 0], ASIDE))
    best = aside & (spare >= spare[aside].max() - 1e-9)
    way = np.linalg.norm(places - here, axis=1)
    return places[np.where(best, way, np.inf).argmin()]


def _beside(p: Array, hand: Moving) -> Array:
    """How far points ``[…, 2]`` are from the hand, wrist to fingertips, seen from above [m]."""
    tip, back = hand.p[:2], -HAND * hand.R[:2, 2]
    along = np.clip((p - tip) @ back / max(float(back @ back), 1e-12), 0.0, 1.0)
    return np.linalg.norm(p - tip - along[..., None] * back, axis=-1)


def put_down(cube: Moving, place: Array, elapsed: float) -> tuple[Moving, bool]:
    """A cube on its way to the table, first level, then down, after it was pulled out.

    Args:
        cube: where it was then, in the world.
        place: where it is put, x and y ``[2]`` [m].
        elapsed: since then [s].

    Returns:
        Where it should be, however it turns, and whether it should have arrived.
    """
    start = cube.p
    for end in (np.array([*place, cube.p[2]]), np.array([*place, REST_HEIGHT])):
        way = end - start
        seconds = max(float(np.linalg.norm(way)) / PUTTING, 1e-6)
        if elapsed < seconds:
            p, v = start + elapsed / seconds * way, way / seconds
            return Moving(cube.R, p, np.zeros(3), v), False
        start, elapsed = end, elapsed - seconds
    return Moving(cube.R, start, np.zeros(3), np.zeros(3)), True
