"""The Gen3's arithmetic, compiled; it knows no scene but in `capsules`.

`chain` is its exact forward kinematics. `closed_form` finds every posture that brings the end
effector to a pose with a given third joint, `solve_branches`, and for many poses at once:
`branches` guesses them for an arm with right angles, `newton` makes them exact. `capsules` sorts
out postures that collide for certain, by distances of `segments`; `nearest` ranks what is left.
"""

from models.gen3.closed_form import solve_branches

__all__ = ["solve_branches"]
