"""Run the story: ``python -m experiments.report``."""

from experiments.kit.command import execute
from experiments.report.story import Config, main

if __name__ == "__main__":
    execute(Config, main)
