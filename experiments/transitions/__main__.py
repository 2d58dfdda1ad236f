"""Run the story: ``python -m experiments.transitions``."""

from experiments.kit.command import execute
from experiments.transitions.story import Config, main

if __name__ == "__main__":
    execute(Config, main)  # type: ignore[arg-type]
