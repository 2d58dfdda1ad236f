"""Run the story: ``python -m experiments.simulate``, or ``... simulate compare A B``."""

import sys

from experiments.kit.command import execute
from experiments.simulate import compare, story

if __name__ == "__main__":
    if sys.argv[1:2] == ["compare"]:
        execute(compare.Config, compare.main, sys.argv[2:])
    else:
        execute(story.Config, story.main)
