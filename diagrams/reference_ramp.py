"""A command followed at limited speed."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import Adder, LinearSystem, MatrixGain, Saturation

from models.arrays import finite_array, finite_number, finite_vector
from models.errors import ModelError


class ReferenceRamp(Diagram):
    """Moves a reference towards its command, each component at most ``speed`` per second.

    ::

               ┌───────────────┐
      command ─┤ ReferenceRamp ├─ reference  [position, velocity], each of size n
               └───────────────┘

    The reference is discrete state. It starts at zero: call `set_reference` on the context
    to start anywhere else. It consists of Drake's own systems, because one written in Python
    and updated at every step of a simulation costs a tenth of it::

       command ──► Adder ──► Saturation ──step──► LinearSystem ──┬──► reference
                     ▲                                           │
                     └── −position ◄── MatrixGain ◄──────────────┘
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
        self._size = size
        one, nothing = np.eye(size), np.zeros((size, size))
        largest = np.broadcast_to(speed * period, size)
        builder = DiagramBuilder()
        way = builder.AddNamedSystem("way", Adder(2, size))
        step = builder.AddNamedSystem("step", Saturation(-largest, largest))
        self._reference = builder.AddNamedSystem(
            "reference",
            LinearSystem(
                A=np.block([[one, nothing], [nothing, nothing]]),
                B=np.vstack([one, one / period]),
                C=np.eye(2 * size),
                D=np.zeros((2 * size, size)),
                time_period=period,
            ),
        )
        back = builder.AddNamedSystem("back", MatrixGain(np.hstack([-one, nothing])))
        builder.Connect(way.get_output_port(), step.get_input_port())
        builder.Connect(step.get_output_port(), self._reference.get_input_port())
        builder.Connect(self._reference.get_output_port(), back.get_input_port())
        builder.Connect(back.get_output_port(), way.get_input_port(1))
        builder.ExportInput(way.get_input_port(0), "command")
        builder.ExportOutput(self._reference.get_output_port(), "reference")
        builder.BuildInto(self)

    def set_reference(self, context: Context, position: np.ndarray) -> None:
        """Put the reference at ``position [size]``, at rest.

        Raises:
            ModelError: if the position is not so many finite numbers.
        """
        position = finite_vector(position, self._size, "position")
        state = self.GetMutableSubsystemContext(self._reference, context)
        state.SetDiscreteState(np.concatenate([position, np.zeros(self._size)]))
