"""Paths without collision, proved between postures, and timed within the arm's limits."""
