"""What an iteration of every method costs, Table 6.1 of the thesis."""
