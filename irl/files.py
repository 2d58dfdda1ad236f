"""Files that are either whole or absent, and their hashes."""

import contextlib
import hashlib
import os
import re
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # not a Unix
    fcntl = None  # type: ignore[assignment]

_TEMPORARY = re.compile(r"\..+(?P<suffix>\.[^.]+)\.[a-z0-9_]{8}(?P=suffix)")


class FileLock:
    """A lock on an open file, which the kernel ends with the process that holds it.

    It binds only those who ask for it; it does not keep anyone from reading or writing.

    Attributes:
        descriptor: of the open file.
    """

    def __init__(self, descriptor: int) -> None:
        """Take charge of an open file; the lock is not asked for yet."""
        self.descriptor = descriptor

    def acquire(self) -> bool | None:
        """Take the lock without waiting: whether it is had, or None where there are no locks."""
        if fcntl is None:
            return None
        try:
            fcntl.flock(self.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return None
        return True

    def release(self) -> None:
        """Close the file, and so end the lock."""
        os.close(self.descriptor)


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; rename it to ``path`` if the block succeeds.

    The temporary file is locked meanwhile: `clear_abandoned` removes it if this process is killed.

    Raises:
        OSError: if the folder or file cannot be written; it names ``path``.
    """
    path = Path(path)
    temporary, lock = _locked_temporary(path)
    try:
        yield temporary
        # mkstemp is private by design; a result is readable like any other file.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    except OSError as error:
        if error.filename is None or error.filename == str(temporary):  # such as of a full disk
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)
        lock.release()


def clear_abandoned(folder: Path) -> None:
    """Remove what ``atomic_path`` left in a folder when its process was killed; nothing else.

    The temporary file of a living process is locked, and so left alone, as all are on a file
    system without locks.
    """
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(folder)):
            if _TEMPORARY.fullmatch(entry.name):
                with contextlib.suppress(OSError):
                    _remove_if_abandoned(Path(entry.path))


def _locked_temporary(path: Path) -> tuple[Path, FileLock]:
    """A new file beside ``path``, locked where locks are."""
    while True:
        descriptor, name = tempfile.mkstemp(
            prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent
        )
        lock = FileLock(descriptor)
        # Another's `clear_abandoned` may have come between making and locking.
        if lock.acquire() is not False and Path(name).exists():
            return Path(name), lock
        lock.release()


def _remove_if_abandoned(path: Path) -> None:
    lock = FileLock(os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | os.O_NONBLOCK))
    try:
        if stat.S_ISREG(os.fstat(lock.descriptor).st_mode) and lock.acquire():
            path.unlink()
    finally:
        lock.release()


def sha256(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
