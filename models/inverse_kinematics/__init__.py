"""Joint positions for a pose of the hand, verified and collision-free."""
