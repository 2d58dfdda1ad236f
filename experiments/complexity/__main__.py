"""Run the story: ``python -m experiments.complexity``."""

from experiments.complexity.story import Config, main
from experiments.kit.command import execute

if __name__ == "__main__":
    execute(Config, main)
