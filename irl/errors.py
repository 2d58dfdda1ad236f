"""Errors that a user can cause, and mend."""

from collections.abc import Iterable


def first_line(error: Exception) -> str:
    """What another library's error says, as one line can hold it; its name if it says nothing."""
    return (str(error).splitlines() or [type(error).__name__])[0]


class InputError(ValueError):
    """Something handed in is wrong; one line says where, why, and what would be valid.

    Attributes:
        place: the file, field or option at fault; empty where the reason names it.
        reason: what is wrong there.
        valid: the choices there are; empty if they cannot be listed.
    """

    def __init__(self, reason: str, *, place: str = "", valid: Iterable[object] = ()) -> None:
        """Compose the message ``place: reason; valid: a, b``, the outer parts if there are any."""
        self.place, self.reason, self.valid = place, reason, tuple(str(name) for name in valid)
        choices = f"; valid: {', '.join(self.valid)}" if self.valid else ""
        super().__init__(f"{place}: {reason}{choices}" if place else f"{reason}{choices}")

    def at(self, place: str) -> "InputError":
        """The same mistake, found elsewhere: where a caller knows better what the place is called.

        Args:
            place: what to name in place of this error's own.
        """
        return InputError(self.reason, place=place, valid=self.valid)
