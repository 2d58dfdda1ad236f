"""Learning to grasp, beyond the demo: Table 6.3, hidden rewards, and knowing when it is enough.

``python -m experiments.grasping table``, ``rewards`` and so on; `experiments/grasping.md` tells
more.
"""

from collections.abc import Callable
from typing import Annotated, Any

import tyro

from experiments.grasping.hidden.enough import Enough, run_enough
from experiments.grasping.hidden.planning import Planning, run_planning
from experiments.grasping.hidden.rewards import Rewards, run_rewards
from experiments.grasping.tables.advice import AdviceGains, run_advice
from experiments.grasping.tables.clusters import Clusters, run_clusters
from experiments.grasping.tables.ensemble import Ensemble, run_ensemble
from experiments.grasping.tables.ladder import Ladder, run_ladder
from experiments.grasping.tables.larger import Larger, run_larger
from experiments.grasping.tables.model_free import ModelFree, run_model_free
from experiments.grasping.tables.network import Network, run_network
from experiments.grasping.tables.questions import Questions, run_questions
from experiments.grasping.tables.table import Table, run_table
from experiments.kit.command import Output

RUN: dict[type, Callable[[Any, Output], dict[str, Any]]] = {
    Table: run_table,
    Ladder: run_ladder,
    Questions: run_questions,
    AdviceGains: run_advice,
    Clusters: run_clusters,
    Network: run_network,
    ModelFree: run_model_free,
    Larger: run_larger,
    Rewards: run_rewards,
    Enough: run_enough,
    Planning: run_planning,
    Ensemble: run_ensemble,
}
Config = (
    Annotated[Table, tyro.conf.subcommand("table")]
    | Annotated[Ladder, tyro.conf.subcommand("ladder")]
    | Annotated[Questions, tyro.conf.subcommand("questions")]
    | Annotated[AdviceGains, tyro.conf.subcommand("advice")]
    | Annotated[Clusters, tyro.conf.subcommand("clusters")]
    | Annotated[Network, tyro.conf.subcommand("network")]
    | Annotated[ModelFree, tyro.conf.subcommand("model_free")]
    | Annotated[Larger, tyro.conf.subcommand("larger")]
    | Annotated[Rewards, tyro.conf.subcommand("rewards")]
    | Annotated[Enough, tyro.conf.subcommand("enough")]
    | Annotated[Planning, tyro.conf.subcommand("planning")]
    | Annotated[Ensemble, tyro.conf.subcommand("ensemble")]
)


def main(config: Any, output: Output) -> dict[str, Any]:
    """Do what the subcommand says."""
    return RUN[type(config)](config, output)
