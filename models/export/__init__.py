"""Robots as files that other tools read, and motions as files that an arm plays.

`files` writes a robot as URDF and SRDF for ROS and pinocchio and as MJCF for MuJoCo, by one call;
nothing else in `models` needs this room. `merged` joins the description files of arm and gripper
into one tree of links, and asks Drake which pairs of links it never compares; `urdf`, `srdf` and
`mjcf` say the same tree in three languages. `trajectories` writes a motion as CSV and for ROS,
`precomputed` as the Gen3's pre-computed form, and checks files of that form.
"""
