"""Errors that a user can cause, and mend."""


class ModelError(ValueError):
    """A model, map or pose handed in is wrong; the message names file, field and valid choices."""
