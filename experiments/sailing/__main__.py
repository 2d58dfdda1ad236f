"""Run the story: ``python -m experiments.sailing``."""

from experiments.kit.command import execute
from experiments.sailing.story import Config, main

if __name__ == "__main__":
    execute(Config, main)
