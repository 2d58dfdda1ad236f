"""The Gen3 Lite's inverse kinematics (thesis A.2), compiled: all solutions of a pose, up to 16.

`ik` puts the two stages together, `solve`, and for many poses at once: `polynomial` finds every
solution of the arm with right angles from the `trigonometric_roots` of one polynomial, and `chain`
makes them exact.
"""

from models.gen3_lite.ik import solve

__all__ = ["solve"]
