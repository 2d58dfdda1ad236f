"""The robot and its task: Gen3 and 2F-85 models, kinematics, rotations, states and actions."""
