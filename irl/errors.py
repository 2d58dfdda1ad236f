"""Errors that a user can cause, and mend."""


class InputError(ValueError):
    """Something handed in is wrong; the message names file, field and valid choices in one line."""
