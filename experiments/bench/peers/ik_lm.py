"""Robotics Toolbox: Levenberg-Marquardt with random restarts, in C++ (`ETS.ik_LM`).

Reads the chain (``y``, ``z``, ``roll`` ``[8]``, as `models.gen3.chain` has them; ``limit [7]``) and
the poses ``X_BE [n, 4, 4]``; writes ``q [n, 7]``, ``success [n]`` and ``seconds`` of the process.
"""

import sys
import time

import numpy as np
from roboticstoolbox import ET, ETS

# Residual ½ eᵀe: below it, position and angle are met within 4.5e-6 m and rad.
TOLERANCE = 1e-11
# Of the methods and gains that the package proposes, the fastest for this arm.
METHOD, GAIN = "chan", 0.1

with np.load(sys.argv[1], allow_pickle=False) as given:
    y, z, roll, limit = given["y"], given["z"], given["roll"], given["limit"]
    poses = given["X_BE"]

chain = ETS()
for i in range(8):
    chain *= ET.ty(y[i]) * ET.tz(z[i]) * ET.Rx(roll[i])
    if i < 7:
        # Answers are wound into a turn, so that an endless joint's bounds exclude none.
        bound = min(limit[i], np.pi)
        chain *= ET.Rz(qlim=[-bound, bound])
chain = ETS(chain)

np.random.seed(0)  # noqa: NPY002 - what the package draws its restarts from
q, success = np.zeros((len(poses), 7)), np.zeros(len(poses), dtype=bool)
chain.ik_LM(poses[0], tol=TOLERANCE, method=METHOD, k=GAIN)
began = time.process_time()
for i, pose in enumerate(poses):
    answer = chain.ik_LM(pose, tol=TOLERANCE, method=METHOD, k=GAIN)
    q[i], success[i] = answer.q, answer.success
np.savez(sys.argv[2], q=q, success=success, seconds=time.process_time() - began)
