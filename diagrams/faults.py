"""A failure of the simulator, told apart from mistakes of ours."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager

_ASSERTION = "Failure at "
"""How Drake's message of a failed assertion begins."""


class SimulatorFault(Exception):  # noqa: N818 - what it is called in records and results
    """Drake failed while it simulated: no verdict on what was simulated, good or bad."""

    @property
    def text(self) -> str:
        """First line of Drake's message; below it the traceback up to where the fault was caught.

        One who wants a short reason reads the first line alone.
        """
        return f"{first_line(str(self))}\n{''.join(traceback.format_exception(self))}".rstrip()


def first_line(text: str) -> str:
    """The reason out of `SimulatorFault.text`; empty if there was no fault."""
    return text.partition("\n")[0]


@contextmanager
def simulating() -> Iterator[None]:
    """Around calls that simulate: what Drake raises there becomes a `SimulatorFault`.

    Drake's own failures reach Python as a plain RuntimeError, or as SystemExit if one of its
    assertions fails. Everything else, such as an error in a system of ours that Drake calls back,
    passes as it is.

    Raises:
        SimulatorFault: from Drake's error.
    """
    try:
        yield
    except RuntimeError as error:
        if type(error) is not RuntimeError:
            raise
        raise SimulatorFault(str(error).strip() or repr(error)) from error
    except SystemExit as error:
        if not str(error).startswith(_ASSERTION):
            raise
        raise SimulatorFault(str(error).strip() or repr(error)) from error
