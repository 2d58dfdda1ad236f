"""Run the story: ``python -m experiments.bench``."""

from experiments.bench.story import Config, main
from experiments.kit.command import execute

if __name__ == "__main__":
    execute(Config, main)
