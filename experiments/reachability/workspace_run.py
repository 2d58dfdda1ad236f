"""The workspace map, computed in chunks that survive the process, and its file."""

import shutil
import time
from concurrent.futures import Future
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from experiments.kit.executors import run_jobs, start_workers
from irl.errors import InputError
from irl.files import atomic_path
from irl.formats import read_json, write_json
from irl.identity import require_same_work
from irl.npz import read_npz, write_npz
from models.errors import ModelError
from models.maps.workspace import FAILURES, Decisions, Grid, WorkspaceSolver
from models.maps.workspace_map import WorkspaceMap
from models.scenes.parsing import description_hash
from models.scenes.planning_scene import MARGIN

FILE = "workspace.npz"
"""The map's file name."""
CHUNK = 2500
"""Poses decided, and kept, at a time."""


@dataclass(frozen=True)
class Plan:
    """What a run computes; a run is resumed with an equal plan only.

    Attributes:
        grid: the poses.
        margin: smallest allowed distance [m].
        chunk: poses at a time.
    """

    grid: Grid
    margin: float = MARGIN
    chunk: int = CHUNK

    def record(self) -> dict[str, Any]:
        """The plan and the model files' hash, as ``run.json`` keeps them."""
        grid = {name: np.asarray(value).tolist() for name, value in asdict(self.grid).items()}
        return {
            **grid,
            "margin": self.margin,
            "chunk": self.chunk,
            "model_files": description_hash(),
        }

    def spans(self) -> list[tuple[int, int]]:
        """First pose of every chunk, and the one after its last."""
        total = self.grid.total
        return [(start, min(start + self.chunk, total)) for start in range(0, total, self.chunk)]


def compute(plan: Plan, folder: Path, workers: int) -> tuple[WorkspaceMap, float]:
    """Decide every pose of a plan; what a killed run left in ``folder`` is not done again.

    Args:
        plan: what to compute.
        folder: made if missing; holds the chunks, each whole or absent.
        workers: processes; the map is the same whatever their number.

    Returns:
        The map, and the seconds that all chunks together took a worker.

    Raises:
        InputError: if ``folder`` is of another plan, or a file in it is damaged.
    """
    spans = plan.spans()
    _open(plan, folder)
    paths = [folder / f"{number:05d}.npz" for number in range(len(spans))]
    missing = [number for number, path in enumerate(paths) if not path.is_file()]
    with tqdm(total=plan.grid.total, unit="pose", desc="poses") as bar:
        for number in set(range(len(spans))) - set(missing):
            bar.update(spans[number][1] - spans[number][0])

        def keep(number: int, chunk: dict[str, np.ndarray]) -> None:
            with atomic_path(paths[number]) as path:
                write_npz(path, chunk)
            bar.update(len(chunk["reason"]))

        if workers == 1:
            for number in missing:
                keep(number, decide_chunk(plan, *spans[number]))
        elif missing:
            waiting = iter(missing)
            with start_workers(min(workers, len(missing))) as running:

                def start(number: int) -> Future[dict[str, np.ndarray]]:
                    return running.executor.submit(decide_chunk, plan, *spans[number])

                for number, chunk in run_jobs(running, lambda: next(waiting, None), start):
                    keep(number, chunk)
    chunks = [read_npz(path) for path in paths]
    parts = [Decisions(chunk["reason"], chunk["q"], chunk["clearance"]) for chunk in chunks]
    seconds = float(sum(chunk["seconds"] for chunk in chunks))
    return WorkspaceMap(plan.grid, Decisions.join(parts)), seconds


def discard(folder: Path) -> None:
    """Remove the chunks once the map is written."""
    shutil.rmtree(folder)


def _open(plan: Plan, folder: Path) -> None:
    """Start a run in ``folder``, or check that the one there is of the same plan."""
    folder.mkdir(exist_ok=True)
    path, wanted = folder / "run.json", plan.record()
    if not path.exists():
        with atomic_path(path) as temporary:
            write_json(temporary, wanted)
        return
    found = read_json(path)
    if not isinstance(found, dict):
        raise InputError(f"a plan's fields are needed; delete {folder}", place=str(path))
    remedy = f"run with the former settings, delete {folder}, or name another folder"
    require_same_work(path, found, wanted, remedy)


def decide_chunk(plan: Plan, start: int, stop: int) -> dict[str, np.ndarray]:
    """Decide poses ``start…stop − 1``; the arrays of `Decisions`, and the seconds it took."""
    solver = _solver(plan.margin)
    began = time.perf_counter()
    decisions = solver.decide(*plan.grid.poses(start, stop))
    return {**vars(decisions), "seconds": np.array(time.perf_counter() - began)}


@cache
def _solver(margin: float) -> WorkspaceSolver:
    solver = WorkspaceSolver(margin)
    solver.decide(*Grid().poses(0, 1))  # compiles, so that no chunk's seconds contain it
    return solver


def write_map(the_map: WorkspaceMap, margin: float, path: Path) -> None:
    """Write a map; equal maps are equal bytes.

    Arrays: ``low``, ``high``, ``spacing``, ``margin`` [m]; ``reason`` of each pose, 0 for a
    reachable one, else one more than an index of ``failures``; ``q`` and ``clearance`` of the
    reachable ones, in order; ``model_files``, their SHA-256. The orientation varies fastest,
    then z, y, x.
    """
    grid = {name: np.array(value) for name, value in asdict(the_map.grid).items()}
    write_npz(
        path,
        {
            **grid,
            **vars(the_map.decisions),
            "margin": np.array(margin),
            "failures": np.array([str(failure) for failure in FAILURES]),
            "model_files": np.array(description_hash()),
        },
    )


def read_map(path: Path) -> WorkspaceMap:
    """Read a map that `write_map` wrote.

    Raises:
        InputError: if the file is missing or damaged, or a field is.
        ModelError: if it was made from other model files, or its sizes do not fit its grid.
    """
    arrays = read_npz(path)
    for name in ("low", "high", "spacing", "reason", "q", "clearance", "failures", "model_files"):
        if name not in arrays:
            raise InputError(f"{path}: field {name!r} is missing; make the map again")
    if str(arrays["model_files"]) != description_hash():
        raise ModelError(f"{path}: field 'model_files' is of other model files; make the map again")
    if arrays["failures"].tolist() != [str(failure) for failure in FAILURES]:
        raise InputError(f"{path}: field 'failures'; valid: {', '.join(FAILURES)}")
    low, high = (tuple(arrays[name].tolist()) for name in ("low", "high"))
    grid = Grid(low, high, float(arrays["spacing"]))
    return WorkspaceMap(grid, Decisions(arrays["reason"], arrays["q"], arrays["clearance"]))
