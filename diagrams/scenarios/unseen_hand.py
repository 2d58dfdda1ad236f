"""A hand that nobody sees: it leads the cube by a force on it, and pries the fingers apart."""

from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from diagrams.gripper_controller import GRIP_FORCE
from diagrams.scenarios.courses import Moving, begin, place_aside, put_down
from diagrams.scenarios.draws import Draws, Kind, Lead, within_reach
from diagrams.scenarios.memory import Done, Memory
from models.rotations import matrix_to_rotation_vector
from models.scenes.parsing import CUBE, GRIPPER
from models.task.spaces import REST_HEIGHT

PERIOD = 0.01
"""Between two looks at what happens [s]."""
STIFFNESS = 200.0
"""How fast the cube is brought to where it should be [rad/s], critically damped."""
STRONGEST = 25.0, 0.5
"""Force [N] and torque [N m] at most."""
MOVES = 0.05
"""Speed of the hand from which it moves [m/s]."""
LIFTED = 0.015
"""Height above the table from which a cube is lifted [m]."""
HELD = 0.04
"""From the tool centre point to the centre of a cube that is in the hand, at most [m]."""
TURNING = 20.0
"""How fast a cube that is put down stops turning [rad/s]; it comes to lie as it likes."""
EARLY = 0.12
"""Distance of the hand from a cube that is pushed before the hand is there, at least [m]."""
SETTLES = 0.15
"""How long a lead goes on where it ends [s]."""
NEARLY = 0.8
"""Share of a lead that must have come about for it to have acted."""
_PADS = {"left": np.array([0.0, -0.0220203, 0.03242]), "right": np.array([0.0, 0.0220203, 0.03242])}
"""The pads' centres in the frames of the inner fingers [m]."""


class UnseenHand(LeafSystem):
    """Pushes the free cube, or moves the held one in the hand or out of it.

    ::

       object.pose ─────┤            ├── spatial_forces  (to the plant)
          tcp.pose ─────┤ UnseenHand │
             state ─────┤            │

    Poses are the true ones. The force is that of a spring and a damper between the cube and where
    it should be at that moment, of at most `STRONGEST`; nothing acts back on anybody. While it
    has hold of a held cube it presses the pads apart, so that less of the grip's force is left.
    """

    def __init__(self, plant: MultibodyPlant, *, grip_force: float = GRIP_FORCE) -> None:
        """Act on the cube of a plant, finalized, whose gripper holds it by ``grip_force`` [N]."""
        super().__init__()
        self._grip_force = grip_force
        self._cube = plant.GetBodyByName(CUBE, plant.GetModelInstanceByName(CUBE))
        n_q, n_v = plant.num_positions(), plant.num_velocities()
        self._cube_v = n_q + self._cube.floating_velocities_start_in_v()
        self._hand_v = n_q + plant.GetJointByName("hand").velocity_start()
        self._mass = self._cube.default_mass()
        self._inertia = self._cube.default_unit_inertia().get_moments()[0] * self._mass
        hand = plant.GetModelInstanceByName(GRIPPER)
        self._fingers = {s: plant.GetBodyByName(f"{s}_inner_finger", hand) for s in _PADS}
        context = plant.CreateDefaultContext()
        X_WG = plant.GetFrameByName("tcp").CalcPoseInWorld(context)
        self._outward = {
            side: np.sign((X_WG.inverse() @ (finger.EvalPoseInWorld(context) @ _PADS[side]))[1])
            for side, finger in self._fingers.items()
        }
        pose = AbstractValue.Make(RigidTransform())
        self._object = self.DeclareAbstractInputPort("object.pose", pose)
        self._tcp = self.DeclareAbstractInputPort("tcp.pose", pose)
        self._state = self.DeclareVectorInputPort("state", n_q + n_v)
        self._memory = self.DeclareAbstractState(Value(Memory()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._update)
        self.DeclareAbstractOutputPort(
            "spatial_forces",
            Value[list[ExternallyAppliedSpatialForce]],
            self._calc_forces,
        )

    def prepare(self, root: Context, draws: Draws) -> None:
        """Have it in mind to do what was drawn, and nothing done yet."""
        self._set(root, Memory(draws.leads))

    def now(self, root: Context, lead: Lead) -> None:
        """Do something at once, whatever else was in mind; what the cube does not allow is left."""
        context = self.GetMyContextFromRoot(root)
        memory = self.memory(root)
        if memory.course is None:
            begun = self._begun(context, replace(memory, leads=(lead,)))
            self._set(root, begun)

    def memory(self, root: Context) -> Memory:
        """Read what it has in mind."""
        return self.GetMyContextFromRoot(root).get_abstract_state(self._memory).get_value()

    def _set(self, root: Context, memory: Memory) -> None:
        self.GetMyMutableContextFromRoot(root).SetAbstractState(self._memory, memory)

    def _bodies(self, context: Context) -> tuple[Moving, Moving]:
        """Cube and hand, in the world."""
        # Copies: what Drake evaluates is a view of what is next.
        state = self._state.Eval(context).copy()
        cube, hand = (
            Moving(
                X.rotation().matrix().copy(),
                X.translation().copy(),
                state[at : at + 3],
                state[at + 3 : at + 6],
            )
            for X, at in (
                (self._object.Eval(context), self._cube_v),
                (self._tcp.Eval(context), self._hand_v),
            )
        )
        return cube, hand

    def _update(self, context: Context, state: State) -> EventStatus:
        memory: Memory = context.get_abstract_state(self._memory).get_value()
        if not memory.leads:
            return EventStatus.DidNothing()
        after = self._wait(context, memory) if memory.course is None else self._go(context, memory)
        if after is memory:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._memory).set_value(after)
        return EventStatus.Succeeded()

    def _wait(self, context: Context, memory: Memory) -> Memory:
        """Wait for the occasion, and from then on as long as was drawn."""
        lead, now = memory.leads[0], context.get_time()
        cube, hand = self._bodies(context)
        moves = bool(np.linalg.norm(hand.v) > MOVES)
        if memory.since < 0.0:
            comes = moves if lead.kind == Kind.PUSH else _is_held(cube, hand)
            if lead.kind == Kind.YANK:
                comes = comes and moves
            return replace(memory, since=now) if comes else memory
        if now < memory.since + lead.wait or (lead.kind == Kind.YANK and not moves):
            return memory
        return self._begun(context, memory)

    def _begun(self, context: Context, memory: Memory) -> Memory:
        """Begin the first lead, or leave it where it is too late or there is no way to go."""
        lead, now = memory.leads[0], context.get_time()
        cube, hand = self._bodies(context)
        if lead.kind == Kind.PUSH:
            fits = not _is_held(cube, hand) and _distance(cube, hand) >= EARLY
        else:
            fits = _is_held(cube, hand)
        course = begin(lead, cube, hand) if fits else None
        if course is None:
            left = Done(lead.kind, now, now, 0.0, 0.0, False)
            return Memory(memory.leads[1:], done=(*memory.done, left))
        return replace(memory, course=course, began=now)

    def _go(self, context: Context, memory: Memory) -> Memory:
        """Go on with the first lead, and let go where it ends."""
        course = memory.course
        assert course is not None
        now, lead = context.get_time(), course.lead
        cube, hand = self._bodies(context)
        if now < memory.began + lead.seconds + SETTLES:
            return memory
        if lead.kind == Kind.YANK:
            if memory.pulled is None:
                x, y = place_aside(cube, hand).tolist()
                return replace(memory, pulled=cube, place=(x, y))
            if not self._put_down(memory, now - SETTLES)[1]:
                return memory
            distance, turn = _distance(cube, hand), 0.0
            acted = cube.p[2] < REST_HEIGHT + LIFTED and within_reach(cube.p)
        else:
            seen = cube if lead.kind == Kind.PUSH else cube.seen_from(hand)
            distance, turn = course.went(seen)
            acted = distance >= NEARLY * lead.distance and turn * np.sign(
                lead.turn
            ) >= NEARLY * abs(lead.turn)
        done = Done(lead.kind, memory.began, now, distance, turn, bool(acted))
        return Memory(memory.leads[1:], done=(*memory.done, done))

    def _calc_forces(self, context: Context, output: AbstractValue) -> None:
        memory: Memory = context.get_abstract_state(self._memory).get_value()
        if memory.course is None:
            output.set_value([])
            return
        course, elapsed = memory.course, context.get_time() - memory.began
        cube, hand = self._bodies(context)
        kind = course.lead.kind
        forces = []
        if kind == Kind.PUSH:
            force, torque = self._pull(cube, course.target(elapsed))
            force[2] = 0.0  # the table carries it
        elif memory.pulled is None:
            # Nobody presses into the table what he moves over it.
            target = course.target(elapsed).within(hand).above_table(cube.R)
            force, torque = self._pull(cube, target)
        else:
            force, _ = self._pull(cube, self._put_down(memory, context.get_time())[0])
            torque = -self._inertia * TURNING * cube.w
        forces.append(_force_on(self._cube, np.zeros(3), force, torque))
        if kind != Kind.PUSH:
            apart = (1.0 - course.lead.grip) * self._grip_force
            for side, finger in self._fingers.items():
                outward = self._outward[side] * apart * hand.R[:, 1]
                forces.append(_force_on(finger, _PADS[side], outward, np.zeros(3)))
        output.set_value(forces)

    @staticmethod
    def _put_down(memory: Memory, time: float) -> tuple[Moving, bool]:
        """Where a yanked cube should be once it is out of the hand, and whether it has arrived."""
        course, pulled = memory.course, memory.pulled
        assert course is not None
        assert pulled is not None
        out = memory.began + course.lead.seconds + SETTLES
        return put_down(pulled, np.array(memory.place), time - out)

    def _pull(self, cube: Moving, target: Moving) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and torque [N m] on the cube, ``[3]`` each, towards where it should be."""
        turn = matrix_to_rotation_vector(target.R @ cube.R.T)
        linear = STIFFNESS**2 * (target.p - cube.p) + 2.0 * STIFFNESS * (target.v - cube.v)
        angular = STIFFNESS**2 * turn + 2.0 * STIFFNESS * (target.w - cube.w)
        most_force, most_torque = STRONGEST
        return (
            _at_most(self._mass * linear, most_force),
            _at_most(self._inertia * angular, most_torque),
        )


def shove(rng: np.random.Generator) -> Lead:
    """A push that somebody gives of his own accord, of 2 to 5 cm and up to 40°."""
    headings = tuple(rng.uniform(-np.pi, np.pi, 32).tolist())
    turn = float(np.radians(rng.uniform(-40.0, 40.0)))
    return Lead(Kind.PUSH, float(rng.uniform(0.02, 0.05)), turn, 0.0, 0.5, 1.0, headings)


def _distance(cube: Moving, hand: Moving) -> float:
    return float(np.linalg.norm(cube.p - hand.p))


def _is_held(cube: Moving, hand: Moving) -> bool:
    """Whether the cube is lifted, and in the hand."""
    return bool(cube.p[2] > REST_HEIGHT + LIFTED) and _distance(cube, hand) <= HELD


def _at_most(vector: np.ndarray, most: float) -> np.ndarray:
    """A vector of at most a length."""
    return vector * min(1.0, most / max(float(np.linalg.norm(vector)), 1e-12))


def _force_on(
    body: RigidBody, p_BQ: np.ndarray, force: np.ndarray, torque: np.ndarray
) -> ExternallyAppliedSpatialForce:
    """A force [N] at a point of a body, in its frame [m], and a torque [N m], in the world."""
    applied = ExternallyAppliedSpatialForce()
    applied.body_index = body.index()
    applied.p_BoBq_B = p_BQ
    applied.F_Bq_W = SpatialForce(torque, force)
    return applied
