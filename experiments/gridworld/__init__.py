"""The method on grids, Figures 6.3 to 6.6 of the thesis."""
