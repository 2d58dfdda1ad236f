"""Learning to grasp, beyond the demo: hidden rewards, and knowing when it is enough.

``python -m experiments.grasping rewards`` and ``enough``; `experiments/grasping.md` tells more.
"""

from typing import Annotated, Any

import tyro

from experiments.grasping.hidden.enough import Enough, run_enough
from experiments.grasping.hidden.rewards import Rewards, run_rewards
from experiments.kit.command import Output

Config = (
    Annotated[Rewards, tyro.conf.subcommand("rewards")]
    | Annotated[Enough, tyro.conf.subcommand("enough")]
)


def main(config: Rewards | Enough, output: Output) -> dict[str, Any]:
    """Do what the subcommand says."""
    if isinstance(config, Rewards):
        return run_rewards(config, output)
    return run_enough(config, output)
