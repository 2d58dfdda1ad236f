"""What becomes of a cube that is let go tilted: face, yaw and place by angle and height.

A state says which of 48 orientations a held cube is nearest to, all with a face down, so trials of
the model let go of cubes that hang nearly level. In an episode one may hang up to 45° off. Here
the same drop is tried with the cube turned about the closing axis, between the pads, from level
to the next face.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from diagrams.trials.record import Outcome, Pair, TrialConfig, TrialRecord
from experiments.kit.executors import Workers, run_jobs
from experiments.kit.kept_rows import KeptRows
from experiments.transitions.worker import release
from irl.metrics import wilson_interval
from models.rotations import rotation_vector_to_matrix
from models.task.discretise import nearest_orientation
from models.task.spaces import GRID_Z, R_WG, R_WO, TILTED, Action, Kind, State
from models.task.trial_classes import TRIAL_POSITION

HAND = TILTED[0]
"""Tilted to the front by 45°: a cube level in the world is the one most turned in the hand."""
ENDS = ("back", "over", "elsewhere")
"""Onto the face it was nearest to at first; onto the next; neither."""


def run_sweep(
    trial: TrialConfig,
    angles: Sequence[float],
    repetitions: int,
    seed: int,
    workers: Workers,
    kept: KeptRows,
) -> list[dict[str, Any]]:
    """Release the cube at each angle and height; points that are kept are not tried again.

    Args:
        trial: course and noise.
        angles: turns about the closing axis from level [degrees].
        repetitions: trials at each.
        seed: root of every trial's own seed.
        workers: where trials run.
        kept: one row a point.

    Returns:
        One row for each angle and height.
    """
    drop = Action(Kind.DROP).index
    points = [
        (Pair(State(TRIAL_POSITION + layer, 0, HAND).index, drop), height, angle)
        for layer, height in enumerate(GRID_Z.tolist())
        for angle in angles
    ]
    first = len(kept.rows)
    jobs = iter(list(product(range(first, len(points)), range(repetitions))))
    found: dict[int, dict[int, TrialRecord]] = defaultdict(dict)

    def start(job: tuple[int, int]) -> Future[TrialRecord]:
        pair, _, angle = points[job[0]]
        turned = float(np.radians(angle))
        return workers.executor.submit(release, trial, pair, turned, seed, job[1])

    total = len(points) * repetitions
    with tqdm(total=total, initial=first * repetitions, unit="trial", desc="releases") as bar:
        for (point, repetition), record in run_jobs(workers, lambda: next(jobs, None), start):
            found[point][repetition] = record
            bar.update()
            # Points are kept in order, whichever is done first.
            while len(found[len(kept.rows)]) == repetitions:
                pair, height, angle = points[len(kept.rows)]
                records = [found[len(kept.rows)][r] for r in range(repetitions)]
                kept.add({"height_m": height, "angle_deg": angle, **summary(pair, records)})
    return kept.rows


def summary(pair: Pair, records: Sequence[TrialRecord]) -> dict[str, Any]:
    """Count what the trials of one angle and height ended in; faults are left out."""
    judged = [record for record in records if record.outcome != Outcome.FAULT]
    ends = [_end(pair, record) for record in judged]
    drift = [record.drift for record in judged]
    return {
        "trials": len(judged),
        "faults": len(records) - len(judged),
        **{end: ends.count(end) for end in ENDS},
        "over_interval": list(wilson_interval(ends.count("over"), len(ends))) if ends else [0, 1],
        "drift_median_m": float(np.median(drift)) if drift else 0.0,
        "drift_max_m": max(drift, default=0.0),
    }


def plot_sweep(figure: Figure, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw where the cube ends by the angle it was released at, a panel for each height."""
    heights = sorted({row["height_m"] for row in rows})
    figure.set_size_inches(5.5 * len(heights), 4)
    panels = figure.subplots(1, len(heights), sharey=True, squeeze=False)[0]
    for panel, height in zip(panels, heights, strict=True):
        mine = [row for row in rows if row["height_m"] == height]
        angle = [row["angle_deg"] for row in mine]
        share = np.array([[row[end] / max(1, row["trials"]) for row in mine] for end in ENDS])
        panel.stackplot(
            angle,
            share,
            labels=[f"falls {end}" for end in ENDS],
            colors=["#4393c3", "#f4a582", "#bababa"],
        )
        low, high = np.array([row["over_interval"] for row in mine]).T
        middle = np.array([row["over"] / max(1, row["trials"]) for row in mine])
        panel.errorbar(
            angle,
            share[0],
            yerr=[np.maximum(0, high - middle), np.maximum(0, middle - low)],
            fmt="k.",
            capsize=2,
            lw=0.8,
        )
        panel.axvline(45.0, color="k", lw=0.5, ls=":")
        panel.set(
            title=f"hand at z = {height:g} m",
            xlabel="turn from level, about the closing axis [°]",
            xlim=(min(angle), max(angle)),
            ylim=(0, 1),
        )
    panels[0].set_ylabel("share of releases, 95 % interval")
    figure.legend(
        *panels[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncol=3,
        frameon=False,
    )


def _end(pair: Pair, record: TrialRecord) -> str:
    """Which face the cube came to lie on, told by the cube's axis that points up."""
    before = R_WO[State.from_index(pair.state).orientation]
    after = R_WO[nearest_orientation(rotation_vector_to_matrix(record.turn) @ before)[0]]
    quarter = rotation_vector_to_matrix(np.pi / 2 * R_WG[HAND][:, 1])
    for end, nominal in (("back", before), ("over", quarter @ before)):
        if after[2] @ nominal[2] > 0.9:
            return end
    return "elsewhere"
