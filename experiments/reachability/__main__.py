"""Run the story: ``python -m experiments.reachability``."""

from experiments.kit.command import execute
from experiments.reachability.story import Config, main

if __name__ == "__main__":
    execute(Config, main)
