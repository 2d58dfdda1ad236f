"""The Gen3 Lite's inverse kinematics (thesis A.2), compiled: all solutions of a pose, up to 16.

`ik` puts the two stages together: `polynomial` finds every solution of the arm with right angles
from the `trigonometric_roots` of one polynomial, and `chain` makes them exact.
"""
