"""mink: differential inverse kinematics by quadratic programs, with random restarts.

Reads the chain (``y``, ``z``, ``roll`` ``[8]``, as `models.gen3.chain` has them; ``limit [7]``) and
the poses ``X_BE [n, 4, 4]``; writes ``q [n, 7]``, ``success [n]`` and ``seconds`` of the process.
"""

import sys
import time

import mink
import mujoco
import numpy as np

TOLERANCE = 4e-6  # of position and angle [m, rad]
RESTARTS, STEPS = 20, 40

with np.load(sys.argv[1], allow_pickle=False) as given:
    y, z, roll, limit = given["y"], given["z"], given["roll"], given["limit"]
    poses = given["X_BE"]

xml = "".join(
    f'<body pos="0 {y[i]} {z[i]}" euler="{roll[i]} 0 0"><joint name="j{i}" axis="0 0 1" '
    + (f'range="{-limit[i]} {limit[i]}" limited="true"' if np.isfinite(limit[i]) else "")
    + '/><geom size="0.01"/>'
    for i in range(7)
)
xml += f'<site name="hand" pos="0 {y[7]} {z[7]}" euler="{roll[7]} 0 0"/>' + "</body>" * 7
model = mujoco.MjModel.from_xml_string(
    f'<mujoco><compiler angle="radian"/><worldbody>{xml}</worldbody></mujoco>'
)
configuration = mink.Configuration(model)
task = mink.FrameTask("hand", "site", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-6)
limits = [mink.ConfigurationLimit(model)]
bound = np.minimum(limit, np.pi)
rng = np.random.default_rng(0)


def solve(pose: np.ndarray) -> tuple[np.ndarray, bool]:
    """Joint angles, and whether they meet the pose."""
    task.set_target(mink.SE3.from_matrix(pose))
    for _ in range(RESTARTS):
        configuration.update(rng.uniform(-bound, bound))
        for _ in range(STEPS):
            if np.abs(task.compute_error(configuration)).max() < TOLERANCE:
                return configuration.q.copy(), True
            try:
                rate = mink.solve_ik(configuration, [task], 1.0, "daqp", limits=limits)
            except mink.exceptions.NoSolutionFound:
                break
            configuration.integrate_inplace(rate, 1.0)
    return configuration.q.copy(), False


solve(poses[0])
q, success = np.zeros((len(poses), 7)), np.zeros(len(poses), dtype=bool)
began = time.process_time()
for i, pose in enumerate(poses):
    q[i], success[i] = solve(pose)
np.savez(sys.argv[2], q=q, success=success, seconds=time.process_time() - began)
