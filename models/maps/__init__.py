"""Which gripper poses an arm reaches, and how.

The Gen3's `reachability` map holds the postures that the task's motions start from and end at:
its poses are in `gripper_poses`, `pose_solver` solves one of them, and `reachability_csv` is its
file. The `workspace` map asks the same of a whole grid of poses; `workspace_map` is what it
answers, `workspace_csv` its file, and `workspace_audit` checks it by Drake alone. `lite` and
`lite_csv` are the Gen3 Lite's map.
"""
