"""Run the story: ``python -m experiments.simulate``, or one of its commands.

``compare A B`` says which of two policies is better, ``scenarios`` what a policy does in each.
"""

import sys

from experiments.kit.command import execute
from experiments.simulate import beside, compare, story

COMMANDS = {"compare": compare, "scenarios": beside}

if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1] in COMMANDS:
        chosen = COMMANDS[sys.argv[1]]
        execute(chosen.Config, chosen.main, sys.argv[2:])
    else:
        execute(story.Config, story.main)
