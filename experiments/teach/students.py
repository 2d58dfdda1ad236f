"""Who may learn in a lesson, with what settings."""

from dataclasses import asdict, replace
from typing import Any

from experiments.teach.worlds import World
from irl.student import StudentConfig

USE_RULES = ("fa_mlirl",)
"""Who takes labels from rules as well, as the thesis does. The others plan: what follows elsewhere
they work out from what actions lead to."""
LEARNS = {
    "goal_posterior": "which weighs the goals and costs that your answers fit, and plans",
    "planning": "which learns what pays where, and plans",
    "fa_mlirl": "the thesis' network",
}
"""How each of them learns, in a few words."""
UNTRUSTED = ("drop_anywhere", "drop_any_height")
"""Rules that are not asked: of the oracle's own drops a third of what the first says is right, and
nothing of the second, for from the upper layer cubes tumble. Everything that the others say is."""
_SHORT = 10
"""Evaluations in which `planning` learns on the robot's task, each 0.15 s. What it learns, pruned,
was the same after 10 as after 300."""


def rules_of(world: World, learner: str) -> tuple[str, ...]:
    """The rules that a learner takes labels from."""
    names = world.subject.generalisation.rule_names if learner in USE_RULES else []
    return tuple(name for name in names if name not in UNTRUSTED)


def student_config(learner: str, seed: int, *, grid: bool = False) -> StudentConfig:
    """The settings of a learner, for the robot's task or for the grid."""
    options: dict[str, Any] = {}
    if learner == "planning":
        # What pays is where runs ended; how much of it needs no long ascent.
        options = {"prune": True, "max_iterations": 300 if grid else _SHORT}
    if learner == "fa_mlirl" and not grid:
        # Torch, which a server that leaves learning to another process does without.
        from experiments.grasping.learning import LearningConfig  # noqa: PLC0415

        # As in the demo, which asks about clusters as well; here the teacher advises unasked.
        active = replace(LearningConfig().active, cluster_query="none", max_demonstrated=None)
        options = asdict(active)
    elif learner == "fa_mlirl":
        training = {"step": 0.003, "beta": 70.0}
        options = {
            "initial": {"iterations": 1000, **training},
            "refine": {"iterations": 100, **training},
            "hidden": (32, 32),
            "state_query": "visitation_entropy",
            "query_beta": 70.0,
        }
    return StudentConfig(learner, seed=seed, options=options)
