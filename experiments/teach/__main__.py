"""Run the story: ``python -m experiments.teach``."""

from experiments.kit.command import execute
from experiments.teach.story import Config, main

if __name__ == "__main__":
    execute(Config, main)
