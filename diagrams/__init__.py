"""Drake systems: the station, its controllers, grasp trials and the policy in closed loop."""
