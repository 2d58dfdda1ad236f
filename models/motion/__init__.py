"""Motions of the Gen3: paths proved free between postures, timed within the arm's limits.

`bounds` proves a neighbourhood of a posture free by one distance query; `paths` joins such
neighbourhoods to segments and paths, and asks `rrt_connect` where no straight one serves;
`timing` makes motions of them. `planner` plans the task's actions so, and `feasibility` counts
which of them have a plan.
"""
