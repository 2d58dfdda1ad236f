"""The page: a 3D view and a question side by side, in a browser on the same machine."""

import os

# The framework would load a library of plots, which this page has none of: 40 MB.
os.environ.setdefault("MATPLOTLIB", "false")
