"""Run the story: ``python -m experiments.grasping``."""

from experiments.grasping.story import Config, main
from experiments.kit.command import execute

if __name__ == "__main__":
    execute(Config, main)  # type: ignore[arg-type]
