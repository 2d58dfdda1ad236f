"""A pose that is measured badly."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from diagrams.scenarios.draws import Draws
from diagrams.scenarios.schema import Noise
from models.rotations import rotation_vector_to_matrix


class PoseNoise(LeafSystem):
    """Adds an error to a pose, a new one every so often.

    ::

       pose ──┤ PoseNoise ├── pose

    The error is normal in each direction and about each axis; what a scenario gives is its root
    mean square distance and angle. It is the same in every episode with the same draws.
    """

    def __init__(self, noise: Noise) -> None:
        """Measure as badly as ``noise`` says."""
        super().__init__()
        self._noise = noise
        self._pose = self.DeclareAbstractInputPort("pose", AbstractValue.Make(RigidTransform()))
        self._draws = self.DeclareAbstractParameter(Value(Draws((0, 0, 0))))
        self._error = self.DeclareAbstractState(Value(RigidTransform()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(noise.period, 0.0, self._update)
        self.DeclareAbstractOutputPort("pose", lambda: Value(RigidTransform()), self._calc_pose)

    def prepare(self, root: Context, draws: Draws) -> None:
        """Draw the errors of one episode."""
        context = self.GetMyMutableContextFromRoot(root)
        context.get_mutable_abstract_parameter(self._draws).set_value(draws)

    def error(self, draws: Draws, number: int) -> RigidTransform:
        """The error of the measurement of a number, counted from 0: to be applied at the cube."""
        p, turn = draws.noise_rng(number).normal(size=(2, 3)) / np.sqrt(3.0)
        R = rotation_vector_to_matrix(np.radians(self._noise.turn) * turn)
        return RigidTransform(RotationMatrix(R), self._noise.position * p)

    def _update(self, context: Context, state: State) -> EventStatus:
        draws = context.get_abstract_parameter(int(self._draws)).get_value()
        number = round(context.get_time() / self._noise.period)
        error = self.error(draws, number)
        state.get_mutable_abstract_state(self._error).set_value(error)
        return EventStatus.Succeeded()

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        X_WO = self._pose.Eval(context)
        X_E = context.get_abstract_state(self._error).get_value()
        p = X_WO.translation() + X_E.translation()
        output.set_value(RigidTransform(X_E.rotation() @ X_WO.rotation(), p))
