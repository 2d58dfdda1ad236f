"""Ctrl-C ends a command without a word, with its processes, and with the exit code 130."""

import os
import signal
from types import FrameType

INTERRUPTED = 130
"""Exit code of what Ctrl-C ended, as shells have it."""


def leave_while_importing() -> None:
    """Let Ctrl-C end this program at once, until `interrupt_as_usual`; nothing is open yet."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)


def interrupt_as_usual() -> None:
    """Let Ctrl-C raise KeyboardInterrupt again."""
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _leave(number: int, frame: FrameType | None) -> None:
    del number, frame
    os._exit(INTERRUPTED)
