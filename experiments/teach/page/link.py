"""A process beside the server, which may be slow, stuck or dead without anybody waiting for it."""

import asyncio
import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from experiments.kit.executors import WorkerProcess, end_with_parent

Work = Callable[..., None]
"""What a process does: ``work(connection, *arguments)``, until the connection ends."""


class Link:
    """A process and the way to it: `tell` never waits, and what it says arrives in the event loop.

    Two threads wait for the pipe, so that a message which is half way when its sender stops holds
    up nothing else. A process that dies is begun anew, unless `close` wanted it.
    """

    def __init__(
        self,
        work: Work,
        arguments: tuple[Any, ...],
        hear: Callable[[Any], None],
        begun: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare a process; `start` begins it.

        Args:
            work: a function of a module: the process imports it.
            arguments: of the function, after the connection.
            hear: is given each message, in the event loop.
            begun: is called at each beginning, the first one included, before anything is heard.
        """
        self._work, self._arguments, self._hear, self._begun = work, arguments, hear, begun
        self._process: WorkerProcess | None = None
        self._outgoing: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._connection: Connection | None = None
        self._closed = False
        self.starts = 0
        """How often the process was begun."""

    @property
    def pid(self) -> int | None:
        """Of the process that runs; None if none does."""
        process = self._process
        return process.pid if process is not None and process.is_alive() else None

    def start(self) -> None:
        """Begin the process; call it in the event loop."""
        loop = asyncio.get_running_loop()
        here, there = Pipe()
        self._process = WorkerProcess(
            target=_run, args=(self._work, there, *self._arguments), daemon=True
        )
        self._process.start()
        there.close()
        self._connection = here
        self.starts += 1
        # What was for the former process is not for this one.
        self._outgoing = queue.SimpleQueue()
        self._begun()
        for target, rest in ((self._read, (loop,)), (self._write, (self._outgoing,))):
            threading.Thread(target=target, args=(here, *rest), daemon=True).start()

    def tell(self, message: Any) -> None:
        """Send a message, now or when the process gets to it."""
        self._outgoing.put(message)

    def restart(self) -> None:
        """End what the process does, and begin it anew."""
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """End the process at once: it holds nothing that is not known here."""
        self._closed = True
        if self._process is not None:
            self._process.kill()
            self._process.join()
        self._outgoing.put(None)

    def _read(self, connection: Connection, loop: asyncio.AbstractEventLoop) -> None:
        with suppress(EOFError, OSError):
            while True:
                loop.call_soon_threadsafe(self._take, connection, connection.recv())
        with suppress(RuntimeError):  # the loop is closed: the server ends
            loop.call_soon_threadsafe(self._again, connection)

    def _take(self, connection: Connection, message: Any) -> None:
        if connection is self._connection:
            self._hear(message)

    def _again(self, connection: Connection) -> None:
        self._outgoing.put(None)
        connection.close()
        if not self._closed:
            self.start()

    @staticmethod
    def _write(connection: Connection, outgoing: "queue.SimpleQueue[Any]") -> None:
        with suppress(OSError, ValueError):
            while (message := outgoing.get()) is not None:
                connection.send(message)


def _run(work: Work, connection: Connection, *arguments: Any) -> None:
    """What the process does; it ends with the server, however that ends."""
    end_with_parent()
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        work(connection, *arguments)
