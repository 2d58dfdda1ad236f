"""A command followed at limited speed."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from models.arrays import finite_array, finite_number, finite_vector
from models.errors import ModelError


class ReferenceRamp(LeafSystem):
    """Moves a reference towards its command, each component at most ``speed`` per second.

    ::

               ┌───────────────┐
      command ─┤ ReferenceRamp ├─ reference  [position, velocity], each of size n
               └───────────────┘

    The reference is discrete state. It starts at zero: call `set_reference` on the context
    to start anywhere else.
    """

    def __init__(self, size: int, *, speed: ArrayLike, period: float) -> None:
        """Ramp ``size`` components, updated every ``period`` seconds.

        Args:
            size: number of components.
            speed: of each, or of all, in their unit per second.
            period: of the updates [s].

        Raises:
            ModelError: if the speed or the period is not above 0.
        """
        period = finite_number(period, "period", above=0.0, valid="seconds above 0")
        speed = finite_array(speed, (), "speed")
        if speed.shape not in ((), (size,)) or not (speed > 0.0).all():
            raise ModelError(f"speed: {speed.tolist()}; valid: above 0, one or {size}")
        super().__init__()
        self._size, self._speed, self._period = size, speed, period
        self._command = self.DeclareVectorInputPort("command", size)
        self._state = self.DeclareDiscreteState(2 * size)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        self.DeclareStateOutputPort("reference", self._state)

    def set_reference(self, context: Context, position: np.ndarray) -> None:
        """Put the reference at ``position [size]``, at rest.

        Raises:
            ModelError: if the position is not so many finite numbers.
        """
        position = finite_vector(position, self._size, "position")
        context.SetDiscreteState(np.concatenate([position, np.zeros(self._size)]))

    def _update(self, context: Context, values: DiscreteValues) -> None:
        position = context.get_discrete_state(self._state).value()[: self._size]
        largest = self._speed * self._period
        step = np.clip(self._command.Eval(context) - position, -largest, largest)
        values.set_value(self._state, np.concatenate([position + step, step / self._period]))
