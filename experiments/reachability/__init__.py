"""Which poses the arms reach."""
