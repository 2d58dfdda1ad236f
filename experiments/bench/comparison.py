"""What every benchmark shares: a row of the result, fair timing, and peers that run elsewhere.

A peer is another package that does the same work. Peers live in a virtual environment of their
own, for their requirements are not ours; a script in ``peers/`` reads arrays from an npz file,
times its own work, and writes arrays to another.
"""

import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from irl.errors import InputError
from irl.npz import read_npz

PEERS = Path(__file__).parent / "peers"
ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes:
        work: what is done.
        ours_s: our time for it [s].
        other: the alternative.
        other_s: its time for the same work [s].
        wanted: the ratio to reach; None where the figure only informs.
        details: whatever else was measured, such as counts and errors.
    """

    work: str
    ours_s: float
    other: str
    other_s: float
    wanted: float | None = None
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def ratio(self) -> float:
        """How many times faster we are."""
        return self.other_s / self.ours_s


def best_of(work: Callable[[], object], repeats: int = 5) -> float:
    """Shortest of several timings of ``work()`` [s], after one call to warm up."""
    work()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process, and those it starts, on one core meanwhile, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@dataclass(frozen=True)
class Peers:
    """The peers' virtual environment.

    Attributes:
        python: its interpreter.
    """

    python: Path = ROOT / ".venv-bench" / "bin" / "python"

    def require(self) -> None:
        """Check that the environment exists.

        Raises:
            InputError: if it does not; says how to make it.
        """
        if not self.python.exists():
            raise InputError(
                f"--peers {self.python}: no such interpreter; `make bench` builds one, or name "
                f"one that has what {PEERS.relative_to(ROOT)}/requirements.txt lists"
            )

    def run(self, script: str, **arrays: np.ndarray) -> dict[str, np.ndarray]:
        """Run ``peers/script`` on one thread; give back the arrays that it wrote.

        Args:
            script: file name.
            arrays: what it reads from the npz file named by its first argument.

        Raises:
            RuntimeError: if it fails; carries the end of what it said.
        """
        single = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        with tempfile.TemporaryDirectory() as folder:
            given, answer = Path(folder) / "given.npz", Path(folder) / "answer.npz"
            np.savez(given, **arrays)  # type: ignore[arg-type]
            done = subprocess.run(
                [self.python, PEERS / script, given, answer],
                env={**os.environ, **single},
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode:
                raise RuntimeError(f"{script} failed:\n{done.stderr[-2000:]}")
            return read_npz(answer)
