"""Which poses a robot reaches: the task's map, the workspace's, the Gen3 Lite's."""
