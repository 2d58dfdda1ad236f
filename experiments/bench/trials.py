"""Grasp trials: how many a second, and whether MuJoCo agrees with what comes out of them."""

import os
import time
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from itertools import product
from typing import Any

import numpy as np

from diagrams.trials.database import Campaign
from diagrams.trials.record import Pair, TrialRecord
from diagrams.trials.rig import MODEL_FILES, TrialRig
from experiments.bench.comparison import Peers, Row
from experiments.bench.grasp_engines import (
    COURSE,
    Ends,
    Engine,
    Grasp,
    in_drake,
    in_mujoco,
    touch_with_pads_alone,
)
from experiments.kit.executors import Workers, start_workers
from experiments.kit.shipped_data import load_feasibility
from experiments.transitions.worker import work
from models.rotations import geodesic_angle
from models.scenes.parsing import description_hash
from models.task.spaces import REST_HEIGHT, TILTED, VERTICAL, Kind, decode_actions

SAMPLE = 24
"""Trials that the pools of workers run, as many of each kind of action."""
YAWS = (0.0, 45.0)
"""Of the cube in the grasps that should end alike [degrees]."""
MISALIGNED = tuple(np.arange(5.0, 45.0, 5.0).tolist())
"""Of the cube under a vertical hand, where closing may turn it flush or jam it [degrees]."""
EDGE_CASES = tuple(product((VERTICAL[0], TILTED[0]), (0.6, 0.8)))
"""Gripper orientation and friction of the grasps whose failure boundary is sought."""
LARGEST_OFFSET, HALVINGS = 0.045, 8  # no part reaches the cube beyond it [m]; to 0.2 mm
WHOLE, PADS = "MuJoCo, the same gripper", "MuJoCo, two pads on slides"
ASKED = ("lifted", "face", "orientation")  # of `Ends`


def rows(peers: Peers, seed: int) -> list[Row]:
    """Time pools of one and two workers; run the same grasps in MuJoCo."""
    rig, bare = TrialRig(COURSE), TrialRig(COURSE)
    touch_with_pads_alone(bare)
    engines: dict[str, Engine] = {
        "ours": partial(in_drake, rig),
        "mujoco": partial(in_mujoco, peers),
        "ours_pads_alone": partial(in_drake, bare),
        "mujoco_pads_alone": partial(in_mujoco, peers, pads_alone=True),
    }
    return [compare_pools(seed), *_outcomes(engines), _misaligned(engines), _boundaries(engines)]


def draw_sample(seed: int) -> list[Pair]:
    """Feasible pairs, as many of each kind of action, the kinds by turns."""
    rng = np.random.default_rng(seed)
    states, actions = np.nonzero(load_feasibility().mask())
    kinds = decode_actions(actions).kind
    drawn = [rng.choice(np.flatnonzero(kinds == k), SAMPLE // len(Kind), False) for k in Kind]
    return [Pair(int(states[i]), int(actions[i])) for i in np.stack(drawn, axis=1).ravel()]


def compare_pools(seed: int) -> Row:
    """The same trials on one worker and on two; they must come out alike."""
    campaign = Campaign(COURSE, seed, description_hash(MODEL_FILES), version("drake"))
    pairs = draw_sample(seed)
    with start_workers(1) as one, start_workers(2) as two:
        alone_s, alone = _timed(one, campaign, pairs)
        both_s, both = _timed(two, campaign, pairs)
    return Row(
        f"{SAMPLE} trials of the four actions, on two workers",
        both_s,
        "on one worker",
        alone_s,
        details={
            "trials_per_s": {"one_worker": SAMPLE / alone_s, "two_workers": SAMPLE / both_s},
            "cpu_s_per_trial": {
                "one_worker": float(np.mean([record.cpu_s for record in alone])),
                "two_workers": float(np.mean([record.cpu_s for record in both])),
            },
            "same_records": [replace(record, cpu_s=0.0) for record in alone]
            == [replace(record, cpu_s=0.0) for record in both],
            "cores": os.cpu_count(),
        },
    )


def _timed(
    workers: Workers, campaign: Campaign, pairs: list[Pair]
) -> tuple[float, list[TrialRecord]]:
    """Wall time [s] and records of trials on workers that each have run one before."""
    submit, warm = workers.executor.submit, set[int]()
    while len(warm) < workers.count():
        first = [submit(_warm_up, campaign, pairs[0]) for _ in range(workers.count())]
        warm |= {future.result() for future in first}
    began = time.perf_counter()
    running: list[Future[TrialRecord]] = [submit(work, campaign, pair, 0) for pair in pairs]
    records = [future.result() for future in running]
    return time.perf_counter() - began, records


def _warm_up(campaign: Campaign, pair: Pair) -> int:
    """Run a trial; which process did."""
    work(campaign, pair, 0)
    return os.getpid()


def _outcomes(engines: dict[str, Engine]) -> list[Row]:
    grasps = [Grasp(hand, yaw) for hand in (*TILTED, *VERTICAL) for yaw in YAWS]
    ours = engines["ours"](grasps)
    theirs = {WHOLE: engines["mujoco"](grasps), PADS: engines["mujoco_pads_alone"](grasps)}
    return [
        Row(
            f"a noise-free grasp, mean of {len(grasps)}",
            float(ours.cpu_s.mean()),
            other,
            float(ends.cpu_s.mean()),
            details={"grasps": len(grasps), **agreement(grasps, ours, ends)},
        )
        for other, ends in theirs.items()
    ]


def agreement(grasps: Sequence[Grasp], ours: Ends, theirs: Ends) -> dict[str, Any]:
    """How many grasps end alike, by what is asked, and those that don't."""
    same = {name: getattr(ours, name) == getattr(theirs, name) for name in ASKED}
    alike = np.all(list(same.values()), axis=0)
    both = ours.lifted & theirs.lifted
    apart = np.linalg.norm(ours.p_WO - theirs.p_WO, axis=1)
    turned = np.degrees(geodesic_angle(ours.R_WO, theirs.R_WO))
    return {
        "same": {name: int(equal.sum()) for name, equal in same.items()},
        "lifted_by_both": int(both.sum()),
        "largest_distance_mm": 1e3 * float(apart[both].max(initial=0.0)),
        "largest_angle_deg": float(turned[both].max(initial=0.0)),
        "disagreements": [
            {
                "gripper": grasp.gripper,
                "cube_yaw_deg": grasp.yaw,
                "ours": _told(ours, i),
                "other": _told(theirs, i),
            }
            for i, grasp in enumerate(grasps)
            if not alike[i]
        ],
    }


def _told(ends: Ends, i: int) -> dict[str, Any]:
    told = {name: getattr(ends, name)[i].item() for name in ASKED}
    height = ends.p_WO[i, 2] - REST_HEIGHT
    return {**told, "height_mm": 1e3 * float(height), "opening_mm": 1e3 * float(ends.opening[i])}


def _misaligned(engines: dict[str, Engine]) -> Row:
    grasps = [Grasp(VERTICAL[0], yaw) for yaw in MISALIGNED]
    ends = {name: engine(grasps) for name, engine in engines.items()}
    return Row(
        f"a grasp out of line with the cube, mean of {len(grasps)}",
        float(ends["ours"].cpu_s.mean()),
        WHOLE,
        float(ends["mujoco"].cpu_s.mean()),
        details={
            "lifted": {name: int(end.lifted.sum()) for name, end in ends.items()},
            "yaw_deg": {"before": MISALIGNED, **{n: e.yaw.tolist() for n, e in ends.items()}},
        },
    )


def find_boundary(engine: Engine, grasps: Sequence[Grasp]) -> tuple[np.ndarray, float]:
    """Offsets ``[n]`` [m] from which on each grasp fails, by bisection; and the time it took.

    Each must lift at offset 0 and fail at `LARGEST_OFFSET`. The time is the processor's, of a
    trial on average [s].
    """
    low, high = np.zeros(len(grasps)), np.full(len(grasps), LARGEST_OFFSET)
    times = []
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        ends = engine([replace(g, offset=m) for g, m in zip(grasps, middle, strict=True)])
        low, high = np.where(ends.lifted, middle, low), np.where(ends.lifted, high, middle)
        times.append(ends.cpu_s)
    return (low + high) / 2, float(np.mean(times))


def _boundaries(engines: dict[str, Engine]) -> Row:
    """How far off the pads may be, by bisection.

    Where the pads end beside the cube, the boxes of the inner knuckles, which are wider, still
    pinch it. Where pads alone hold little more than a corner, hydroelastic contact yields until
    it slips out; contact at points holds on to the last.
    """
    grasps = [Grasp(hand, friction=friction) for hand, friction in EDGE_CASES]
    found = {name: find_boundary(engine, grasps) for name, engine in engines.items()}
    offset = {name: 1e3 * boundary for name, (boundary, _) in found.items()}
    return Row(
        f"a grasp near the pads' edge, mean of {HALVINGS * len(grasps)}",
        found["ours"][1],
        WHOLE,
        found["mujoco"][1],
        details={
            "boundaries_mm": [
                {
                    "gripper": grasp.gripper,
                    "friction": grasp.friction,
                    **{name: float(offset[name][i]) for name in engines},
                    "pads_reach": 1e3 * grasp.overlap_limit,
                }
                for i, grasp in enumerate(grasps)
            ],
            "resolution_mm": 1e3 * LARGEST_OFFSET / 2**HALVINGS,
            "largest_difference_mm": {
                "whole_gripper": float(np.abs(offset["ours"] - offset["mujoco"]).max()),
                "pads_alone": float(
                    np.abs(offset["ours_pads_alone"] - offset["mujoco_pads_alone"]).max()
                ),
            },
        },
    )
