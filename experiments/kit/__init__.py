"""What stories share: options and results, processes, kept rows, shipped data."""
