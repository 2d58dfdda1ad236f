"""Text files that somebody hands in."""

from pathlib import Path

from models.errors import ModelError


def read_text(path: str | Path, valid: str) -> str:
    """The text of a UTF-8 file.

    Args:
        path: the file.
        valid: what was wanted there, for the message.

    Raises:
        ModelError: if it is missing, no file, or no UTF-8.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_file():  # a pipe would be waited for
            raise ModelError(f"{path}: not a file; valid: {valid}")
        return path.read_bytes().decode("utf-8")
    except OSError as error:
        raise ModelError(f"{path}: cannot be read ({error.strerror}); valid: {valid}") from None
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: no text in UTF-8 (byte {error.start}); valid: {valid}") from None
