"""Motions of the Gen3: paths proved free between postures, timed within the arm's limits.

`bounds` proves a neighbourhood of a posture free by one distance query; `paths` joins such
neighbourhoods to segments and paths, and asks `rrt_connect` where no straight one serves;
`timing` makes motions of them. `planner` plans the task's actions so, as `moves` one after another:
with the cube where `cube` says that it is, `straight` up where that matters, by postures of other
`families` where the first leads nowhere. `failures` names what kept it from that; `feasibility`
counts which actions have a plan.
"""
