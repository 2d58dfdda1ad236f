"""The Gen3 Lite's arithmetic: chain, and inverse kinematics by polynomials."""
