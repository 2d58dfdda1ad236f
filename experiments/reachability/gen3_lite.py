"""The Gen3 Lite's part of ``experiments.reachability``: its map (thesis A.3) and how the two
stages of its inverse kinematics fare (A.2).
"""  # noqa: D205

from collections import Counter
from time import perf_counter
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from tqdm import tqdm

from experiments.kit.command import Output
from experiments.kit.shipped_data import MAP
from models.gen3_lite.chain import LIMIT, forward, tune
from models.gen3_lite.ik import solve_batch, within_limits
from models.maps.lite import NONE, STARTS, VALUES, Entry, build, numerical
from models.maps.lite_csv import write_map
from models.task.spaces import GRIPPER_NAMES, POSITIONS

RANDOM_POSES = 2000
"""How many random poses, of configurations within the limits, the stages are tried on."""

_KINDS = {
    "0: no solution": "#c9ccd1",
    "0: solutions beyond the joint limits": "#f0c987",
    "0: solutions that collide": "#d9826b",
    "1: by polynomial and fine-tuning": "#4c9f70",
    "2: by the numerical solver only": "#3f6fb5",
}


def run(seed: int, output: Output) -> dict[str, Any]:
    """Build the map, try the stages, draw; return what goes into ``result.json``."""
    tried = stages(np.random.default_rng(seed))  # first: compiles, outside the map's clock
    started = perf_counter()
    with tqdm(desc="poses", unit="pose", total=len(GRIPPER_NAMES) * len(POSITIONS)) as bar:
        entries = build(seed, lambda done, _: bar.update(done - bar.n))
    seconds = perf_counter() - started
    with output.file(MAP) as path:
        write_map(entries, seed, path)
    with output.figure("reachability.png") as figure:
        draw(figure, entries)
    counts = Counter(entry.value for entry in entries)
    failures = Counter(str(entry.failure) for entry in entries if entry.value == NONE)
    result: dict[str, Any] = {
        "reachable": len(entries) - counts[NONE],
        "total": len(entries),
        "values": {str(value): counts[value] for value in VALUES},
        "failures": dict(failures),
        "solves_per_s": len(entries) / seconds,
        "ik_stages": tried,
    }
    told = ", ".join(f"{number} of value {value}" for value, number in result["values"].items())
    print(f"{result['reachable']} of {result['total']} poses reachable: {told}")
    print(f"failures: {dict(failures)}")
    for stage, figures in tried.items():
        print(f"{stage:>14}: {figures}")
    return result


def stages(rng: np.random.Generator) -> dict[str, Any]:
    """Try the stages of inverse kinematics on poses that the arm is known to reach.

    Errors are the largest component of position [m] and rotation vector [rad].
    """
    known = rng.uniform(-LIMIT, LIMIT, (RANDOM_POSES, 6))
    poses = [forward(q) for q in known]
    R, p = (np.array(part) for part in zip(*poses, strict=True))
    solve_batch(R[:1], p[:1])
    started = perf_counter()
    found = solve_batch(R, p)
    seconds = perf_counter() - started
    exists = ~np.isnan(found.error)
    apart = np.abs((found.q - known[:, None] + np.pi) % (2.0 * np.pi) - np.pi).max(axis=-1)
    alone = [numerical(R[i], p[i], rng) for i in range(RANDOM_POSES)]
    one = [tune(np.zeros(6), R[i], p[i]) is not None for i in range(RANDOM_POSES)]
    return {
        "polynomial": {
            "poses": RANDOM_POSES,
            "poses_solved": int(exists.any(axis=1).sum()),
            "solutions": int(exists.sum()),
            "solutions_within_limits": int(within_limits(found.q).sum()),
            "solutions_of_a_pose": {
                str(k): n for k, n in sorted(Counter(exists.sum(axis=1).tolist()).items())
            },
            **_errors(found.rough_error[exists]),
        },
        "fine_tuning": {
            "starts": int(found.starts.sum()),
            "converged": int((found.starts - found.failures).sum()),
            "poses_whose_own_joints_return": int(
                (np.nan_to_num(apart, nan=1.0) < 1e-6).any(1).sum()
            ),
            "poses_per_s": RANDOM_POSES / seconds,
            **_errors(found.error[exists]),
        },
        "numerical_alone": {
            "starts": STARTS,
            "poses_solved": sum(map(bool, alone)),
            "poses_solved_from_one_start": sum(one),
            "poses_solved_within_limits": sum(
                any(within_limits(q) for q in answers) for answers in alone
            ),
        },
    }


def _errors(errors: np.ndarray) -> dict[str, float]:
    return {"error_median": float(np.median(errors)), "error_max": float(errors.max())}


def draw(figure: Figure, entries: list[Entry]) -> None:
    """Draw the map's values, and how many solutions each pose has within the limits."""
    kinds = np.empty((len(GRIPPER_NAMES), len(POSITIONS)), dtype=int)
    figure.set_size_inches(11, 7.5)
    axis = figure.subplots()
    for entry in entries:
        column = int(np.linalg.norm(POSITIONS - entry.p_WG, axis=1).argmin())
        rejected = (entry.solutions > 0) + (entry.within_limits > 0)
        kinds[entry.gripper, column] = entry.value + 2 if entry.value else rejected
        text = f"{entry.within_limits}/{entry.solutions}" if entry.solutions else ""
        axis.text(column, entry.gripper, text, ha="center", va="center", fontsize=9)
    colours = list(_KINDS.values())
    norm = BoundaryNorm(np.arange(len(colours) + 1) - 0.5, len(colours))
    axis.imshow(kinds, cmap=ListedColormap(colours), norm=norm, aspect="auto")
    axis.set(
        xticks=range(len(POSITIONS)),
        yticks=range(len(GRIPPER_NAMES)),
        yticklabels=[f"{i} {name}" for i, name in enumerate(GRIPPER_NAMES)],
        xlabel="position of the tool centre point [m]",
    )
    axis.set_title("Gen3 Lite: reachable poses, and solutions within the limits / in all")
    labels = [f"({x:g}, {y:g}, {z:g})" for x, y, z in POSITIONS]
    axis.set_xticklabels(labels, rotation=60, ha="right", fontsize=9)
    handles = [
        Patch(color=colour, label=f"{label} ({(kinds == i).sum()})")
        for i, (label, colour) in enumerate(_KINDS.items())
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
