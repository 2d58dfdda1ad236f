"""Other methods of inverse reinforcement learning, to compare with on the same models."""
