"""One run a folder: a lock that dies with its process, and what killed ones left is cleared."""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

from irl.errors import InputError
from irl.files import FileLock, clear_abandoned

LOCK = ".running"
"""Held while a command runs; it says which process that is, and since when."""


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other commands out of an output folder, and clear what killed ones left in it.

    The lock is the kernel's, so that it ends with this process, however that ends. Where a file
    system has none, or cannot be written, all goes on without.

    Raises:
        InputError: if another process runs in ``folder``; names it.
    """
    lock = _locked(folder / LOCK)
    try:
        clear_abandoned(folder)
        yield
    finally:
        if lock is not None:
            with contextlib.suppress(OSError):
                (folder / LOCK).unlink()
            lock.release()


def _locked(path: Path) -> FileLock | None:
    """The lock, with this process' number and the time in its file; None where there is none."""
    while True:
        try:
            lock = FileLock(os.open(path, os.O_RDWR | os.O_CREAT, 0o666))
        except OSError:
            return None
        held = lock.acquire()
        if held is None:
            with contextlib.suppress(OSError):
                path.unlink()
            lock.release()
            return None
        if not held:
            told = os.pread(lock.descriptor, 200, 0).decode(errors="replace").strip()
            lock.release()
            raise InputError(
                f"{told or 'another process'} is writing there; wait for it, or give another "
                "folder",
                place=f"--out {path.parent}",
            )
        # Whoever held it before may have removed it since it was opened here.
        with contextlib.suppress(OSError):
            if os.path.samestat(os.fstat(lock.descriptor), path.stat()):
                break
        lock.release()
    now = time.strftime("%Y-%m-%d %H:%M:%S")
    with contextlib.suppress(OSError):  # a full disk: the lock holds, without a name
        os.ftruncate(lock.descriptor, 0)
        os.pwrite(lock.descriptor, f"process {os.getpid()}, since {now},".encode(), 0)
    return lock
