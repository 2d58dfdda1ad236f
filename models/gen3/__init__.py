"""The Gen3's arithmetic, compiled: chain, closed-form inverse kinematics, capsules."""
