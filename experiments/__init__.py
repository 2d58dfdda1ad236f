"""Stories, each a command: ``python -m experiments.NAME`` tells one from top to bottom.

A story is a folder with a ``story.py`` in it, or a single module; its options are the fields of a
``Config``, and its results go to ``out/NAME``. The rooms in reading order:

* what all of them share: `kit`, options and results, processes, kept rows, shipped data;
* to learn by doing: `tutorial`, `own_task`, `toy_text`;
* the method on small worlds: `gridworld`, `sailing`, `complexity`;
* the robot's task: `reachability`, `transitions`, `grasping`, and `demo`, which is what all of it
  is for; `simulate` plays what was learnt once more;
* about the code: `bench`, every speed claim beside its alternative, and `docs`, these pages.

``data`` holds what is shipped, ``results`` what RESULTS.md shows.
"""
