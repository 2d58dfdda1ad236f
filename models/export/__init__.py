"""The robots as files that other tools read: URDF and SRDF for ROS and pinocchio, MJCF for MuJoCo.

`files` writes all three, by one call; nothing else in `models` needs this room. `merged` joins the
description files of arm and gripper into one tree of links, and asks Drake which pairs of links it
never compares; `urdf`, `srdf` and `mjcf` say the same tree in three languages.
"""
