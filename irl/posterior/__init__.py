"""``goal_posterior``: Bayesian inverse reinforcement learning with structured hypotheses."""
