"""The grasping task: its states and actions, and what can be said of them without a robot."""
