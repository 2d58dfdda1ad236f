"""What to ask an expert, Figures 6.1 and 6.2 of the thesis."""
