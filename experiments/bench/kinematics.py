"""Inverse kinematics of the Gen3: verified answers a second, and a whole workspace map.

Every answer, ours or a peer's, is judged by the same forward kinematics and joint limits. Times
are the process' own on one core, so that what else the machine does does not count.
"""

import time

import numpy as np

from experiments.bench.comparison import Peers, Row, one_core
from models.gen3.chain import LIMIT, ROLL, Y, Z, forward
from models.gen3.closed_form import solve_first
from models.inverse_kinematics.optimised import Starts, search
from models.inverse_kinematics.solution import ANGLE_TOLERANCE, POSITION_TOLERANCE
from models.inverse_kinematics.solver import IkSolver
from models.inverse_kinematics.sweep import Sweep
from models.maps.gripper_poses import gripper_pose
from models.maps.workspace import REACHABLE, Decisions, Grid, WorkspaceSolver
from models.scenes.planning_scene import HOME, PlanningScene

SWEEP = np.concatenate([[0.0, np.pi], np.linspace(-np.pi, np.pi, 64, endpoint=False) + 0.02])
"""Values of q3 to try, in this order [rad]."""
POSES, FEW = 5000, 200
"""Poses for the fast ones, and for the slow ones, each a pose of random joint angles."""
SAMPLE = 3000
"""Poses of the workspace map that the peer's time is taken on."""
REPEATS = 5
_CHUNK = 2500


def rows(peers: Peers, seed: int) -> list[Row]:
    """Compare on one core: batches of reachable poses; the workspace map."""
    with one_core():
        return [*_batches(peers, seed), _map(peers, seed)]


def _batches(peers: Peers, seed: int) -> list[Row]:
    bound = np.minimum(LIMIT, np.pi)
    postures = np.random.default_rng(seed).uniform(-bound, bound, (POSES, 7))
    X_BE = _poses(postures)
    R, p = np.ascontiguousarray(X_BE[:, :3, :3]), np.ascontiguousarray(X_BE[:, :3, 3])
    solve_first(R[:1], p[:1], SWEEP)
    began = time.process_time()
    for _ in range(REPEATS):
        q, _ = solve_first(R, p, SWEEP)
    ours_s = (time.process_time() - began) / REPEATS
    theirs = _peer(peers, "ik_lm.py", X_BE)
    ours, lm = verified(q, X_BE), verified(theirs["q"], X_BE)
    mink = _peer(peers, "mink_ik.py", X_BE[:FEW])
    by_mink = verified(mink["q"], X_BE[:FEW])
    # Time for as many verified answers as there are poses.
    scaled = ours_s / ours.mean()
    counts = {"poses": POSES, "ours_verified": int(ours.sum())}
    nearest_s, drake_s, details = _nearest(postures)
    return [
        Row(
            f"{POSES} poses of the Gen3, each met within 1e-5 m and 1e-5 rad and the limits",
            scaled,
            "roboticstoolbox ik_LM (C++)",
            float(theirs["seconds"]) / lm.mean(),
            40.0,
            {**counts, "other_verified": int(lm.sum()), "ours_per_s": POSES / scaled},
        ),
        Row(
            f"{FEW} of these poses",
            scaled * FEW / POSES,
            "mink (quadratic programs)",
            float(mink["seconds"]) / max(by_mink.mean(), 1.0 / FEW),
            None,
            {"poses": FEW, "other_verified": int(by_mink.sum())},
        ),
        Row(
            f"{FEW} poses of free postures, each met by a free one near home",
            nearest_s,
            "Drake's InverseKinematics with SNOPT and random restarts",
            drake_s,
            10.0,
            details,
        ),
    ]


def _nearest(postures: np.ndarray) -> tuple[float, float, dict[str, int]]:
    """Seconds that `IkSolver` and the optimiser take for the same poses; what they solved."""
    scene = PlanningScene()
    solver = IkSolver(scene)
    poses = [scene.forward(q) for q in postures if scene.is_free(q)][:FEW]
    solver.solve(poses[0])
    began = time.process_time()
    ours = sum(solver.solve(X_WG).q is not None for X_WG in poses)
    between = time.process_time()
    theirs = 0
    for i, X_WG in enumerate(poses):
        rng = np.random.default_rng(i)
        answers = search(scene, X_WG, Starts(HOME, 20, rng))
        theirs += answers[0].q is not None
    ended = time.process_time()
    details = {"poses": len(poses), "ours_solved": ours, "other_solved": theirs}
    return between - began, ended - between, details


def _map(peers: Peers, seed: int) -> Row:
    grid = Grid()
    solver = WorkspaceSolver()
    solver.decide(*grid.poses(0, 1))
    spans = range(0, grid.total, _CHUNK)
    began = time.process_time()
    decided = Decisions.join(
        [solver.decide(*grid.poses(i, min(i + _CHUNK, grid.total))) for i in spans]
    )
    ours_s = time.process_time() - began
    chosen = np.random.default_rng(seed).choice(grid.total, SAMPLE, replace=False)
    p_WG, gripper = grid.poses(0, grid.total)
    arm = Sweep.of(PlanningScene())
    assert arm is not None
    X_BE = np.tile(np.eye(4), (SAMPLE, 1, 1))
    for X, i in zip(X_BE, chosen, strict=True):
        X[:3, :3], X[:3, 3] = arm.end_effector(gripper_pose(p_WG[i], int(gripper[i])))
    theirs = _peer(peers, "ik_lm.py", X_BE)
    met = verified(theirs["q"], X_BE)
    return Row(
        f"workspace map: {grid.total:,} poses, every positive confirmed collision-free by Drake",
        ours_s,
        "roboticstoolbox ik_LM (C++), no collision check",
        float(theirs["seconds"]) * grid.total / SAMPLE,
        1.0,
        {
            "reachable": int((decided.reason == REACHABLE).sum()),
            "other_timed_poses": SAMPLE,
            "other_s_is": f"extrapolated from {SAMPLE} random poses of the map",
            "other_met_in_sample": int(met.sum()),
            "ours_reachable_in_sample": int((decided.reason[chosen] == REACHABLE).sum()),
        },
    )


def _peer(peers: Peers, script: str, X_BE: np.ndarray) -> dict[str, np.ndarray]:
    chain = {"y": Y, "z": Z, "roll": ROLL, "limit": LIMIT}
    return peers.run(script, X_BE=X_BE, **chain)


def _poses(q: np.ndarray) -> np.ndarray:
    X_BE = np.tile(np.eye(4), (len(q), 1, 1))
    for X, row in zip(X_BE, q, strict=True):
        X[:3, :3], X[:3, 3] = forward(row)
    return X_BE


def verified(q: np.ndarray, X_BE: np.ndarray) -> np.ndarray:
    """Whether joint angles ``[n, 7]`` meet poses ``[n, 4, 4]`` and the limits: ``[n]``."""
    known = ~np.isnan(q).any(axis=1)
    X = _poses(np.where(known[:, None], q, HOME))
    distance = np.linalg.norm(X[:, :3, 3] - X_BE[:, :3, 3], axis=1)
    # The chord between two rotations is √8·sin(angle / 2).
    chord = np.linalg.norm(X[:, :3, :3] - X_BE[:, :3, :3], axis=(1, 2))
    angle = 2.0 * np.arcsin(np.clip(chord / np.sqrt(8.0), 0.0, 1.0))
    within = (np.abs(q) <= LIMIT).all(axis=1)
    return known & within & (distance <= POSITION_TOLERANCE) & (angle <= ANGLE_TOLERANCE)
