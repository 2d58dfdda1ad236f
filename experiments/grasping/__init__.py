"""Learning the grasping task from a teacher, and playing what was learnt."""
