"""One writer a database: a lock that ends with its process, however that ends."""

import fcntl
import os
from contextlib import suppress
from pathlib import Path

from models.errors import ModelError


class WriterLock:
    """Keeps a second writer off a file; readers do not mind it.

    The lock is on a file of its own beside it, ``trials.db-writer``: to open and close the database
    itself a second time would end the locks that SQLite has on it.
    """

    def __init__(self, path: Path) -> None:
        """Take the lock; where the disk has none, all goes on without.

        Raises:
            ModelError: if another has it.
            OSError: if the folder cannot be written.
        """
        self._path = path.with_name(f"{path.name}-writer")
        self._descriptor: int | None = None
        while self._descriptor is None:
            descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                raise ModelError(
                    f"{path}: another process is writing there; wait for it, or take another "
                    "--database"
                ) from None
            except OSError:
                os.close(descriptor)
                return
            # Whoever had it before may have removed the file since it was opened here.
            with suppress(OSError):
                if os.path.samestat(os.fstat(descriptor), self._path.stat()):
                    self._descriptor = descriptor
                    return
            os.close(descriptor)

    def release(self) -> None:
        """End the lock and remove its file."""
        if self._descriptor is not None:
            with suppress(OSError):
                self._path.unlink()
            os.close(self._descriptor)
            self._descriptor = None
