"""Run the story: ``python -m experiments.simulate``."""

from experiments.kit.command import execute
from experiments.simulate.story import Config, main

if __name__ == "__main__":
    execute(Config, main)
