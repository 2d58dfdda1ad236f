"""Run the story: ``python -m experiments.hold``."""

from experiments.hold.story import Config, main
from experiments.kit.command import execute

if __name__ == "__main__":
    execute(Config, main)
