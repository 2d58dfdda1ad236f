"""Stories, each a command: ``python -m experiments.NAME`` tells one from top to bottom.

A story is a folder with a ``story.py`` in it, or a single module; its options are the fields of a
``Config``, and its results go to ``out/NAME``. The rooms in reading order:

* what all of them share: `experiments.kit`, options and results, processes, kept rows, shipped
  data;
* to learn by doing: `experiments.tutorial`, `experiments.own_task`, `experiments.toy_text`;
* the method on small worlds: `experiments.gridworld`, `experiments.sailing`,
  `experiments.complexity`; every method where the teacher mostly errs: `experiments.noisy`;
* the robot's task: `experiments.reachability`, `experiments.transitions`, `experiments.grasping`,
  and `experiments.demo`, which is what all of it is for; `experiments.simulate` plays what was
  learnt once more;
* about the code: `experiments.bench`, every speed claim beside its alternative, and
  `experiments.docs`, these pages.

The folder ``data`` holds what is shipped, ``results`` what RESULTS.md shows.
"""

import sys

from experiments.kit.interruption import leave_while_importing

if sys.argv[:1] == ["-m"]:  # python -m experiments.NAME, which is about to be found and imported
    leave_while_importing()
