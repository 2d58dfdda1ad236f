"""Where the grid-world's recipe struggles, and what state preferences and queries mend.

Every case is learnt with and without the thesis' state preferences (§6.2: the goal preferred,
the limits avoided), and with and without queries by Algorithm 4.1, which the demonstrator answers
with trajectories. Who errs in demonstrations errs as often in answers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import torch

from experiments.gridworld.learning import Learning
from experiments.kit.executors import Mapper, run_all
from irl.active import ActiveConfig, Progress, active_fa_mlirl
from irl.collection import mislabel
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import GridWorld, bar, four_rooms, goal_cell
from irl.metrics import bootstrap_interval
from irl.problem import LearningProblem
from irl.teacher import Teacher

REFINE = 0.1  # share of the iterations that training after each answer takes


@dataclass(frozen=True)
class Case:
    """A world and what is wrong with its demonstrations.

    Attributes:
        name: what the figure calls it.
        world: the grid.
        trajectories: diagonal or border.
        wrong: share of the demonstrated actions that lead no nearer to the goal.
        corners: whose trajectories are shown, counted counter-clockwise from (0, 0); with the
            goal at the centre, a trajectory keeps to the quadrant of its corner.
    """

    name: str
    world: GridWorld
    trajectories: str
    wrong: float = 0.0
    corners: tuple[int, ...] = (0, 1, 2, 3)

    def demonstrations(self, rng: np.random.Generator) -> Demonstrations:
        """The trajectories of ``world``, less or worse as the case has it."""
        walks = self.world.trajectories(self.trajectories)
        shown = Demonstrations.from_trajectories(walks[corner] for corner in self.corners)
        # In some corners every move is right.
        worse = self.world.model.mask & ~self.demonstrator.optimal_actions
        return mislabel(shown, worse, self.wrong, rng)

    @cached_property
    def demonstrator(self) -> OracleDemonstrator:
        """Knows the shortest ways, and errs as often as the demonstrations do."""
        world = self.world
        return OracleDemonstrator(
            world.model,
            np.array([world.goal_state]),
            gamma=1 - 1 / world.n,  # so that the goal is felt across the grid
            label_noise=self.wrong,
        )


def cases(n: int, trajectories: str, wrong: Sequence[float]) -> list[Case]:
    """Every case at side n; ``wrong`` are the shares of wrong actions to try.

    Raises:
        InputError: if n is even or below 3.
    """
    centre, offset = goal_cell(n, "centre"), goal_cell(n, "offset")
    open_grid = GridWorld(n, centre)
    return [
        Case("goal at a corner", GridWorld(n, goal_cell(n, "corner")), trajectories),
        Case("wall", GridWorld(n, offset, bar(n)), trajectories),
        Case("four rooms", GridWorld(n, offset, four_rooms(n)), trajectories),
        *(
            Case(f"{share:.0%} wrong actions", open_grid, trajectories, wrong=share)
            for share in wrong
        ),
        Case("unseen quadrant", open_grid, trajectories, corners=(1, 2, 3)),
        Case("unseen half", open_grid, trajectories, corners=(1, 2)),
    ]


@dataclass(frozen=True)
class HardLesson:
    """One run: a case, what help there is, and from which random numbers."""

    case: Case
    state_preferences: bool
    queries: int
    state_query: str
    seed: int
    settings: Learning


@dataclass(frozen=True)
class Judged:
    """What was known, and how good the policy was, after some queries.

    Attributes:
        queries: answered so far.
        accuracy: share of the cells from which the goal is reached.
        shortest: share of the cells from which it is reached by a shortest way.
        demonstrated: share of the cells labelled.
        policy: int8 ``[n_states]``.
        labelled: int64, the states labelled.
    """

    queries: int
    accuracy: float
    shortest: float
    demonstrated: float
    policy: np.ndarray
    labelled: np.ndarray


def learn_hard(lesson: HardLesson) -> list[Judged]:
    """Run Algorithm 4.1 on a case; judged before the first query and after the last."""
    torch.set_num_threads(1)
    case, settings, world = lesson.case, lesson.settings, lesson.case.world
    rng = np.random.default_rng(lesson.seed)
    training = settings.training(world.n)
    judged = []

    def watch(progress: Progress) -> None:
        if progress.q is not None:
            policy, labels = progress.q.argmax(axis=1), progress.labels
            judged.append(
                Judged(
                    queries=progress.query,
                    accuracy=world.accuracy(policy),
                    shortest=world.shortest(policy),
                    demonstrated=labels.demonstrated_fraction(int((world.distance >= 0).sum())),
                    policy=policy.astype(np.int8),
                    labelled=np.unique(labels.state),
                )
            )

    active_fa_mlirl(
        LearningProblem(
            world.model,
            world.features,
            gamma=case.demonstrator.gamma,
            preferences=world.preferences(),
        ),
        case.demonstrations(rng),
        Teacher(case.demonstrator),
        ActiveConfig(
            initial=training,
            refine=settings.training(world.n, REFINE),
            budget=lesson.queries,
            state_query=lesson.state_query,
            cluster_query="none",
            query_beta=training.beta,
            state_preferences=lesson.state_preferences,
            hidden=settings.hidden,
        ),
        rng=rng,
        callback=watch,
    )
    return judged[:1] + judged[1:][-1:]


def hard_rows(
    hard: Sequence[Case],
    queries: int,
    state_query: str,
    seeds: Sequence[int],
    settings: Learning,
    over: Mapper,
) -> tuple[list[dict[str, Any]], list[Judged]]:
    """Every case with every kind of help: what ``result.json`` says, and the first seed's story."""
    kinds = list(product(hard, (False, True)))
    lessons = [
        HardLesson(case, preferences, queries, state_query, seed, settings)
        for case, preferences in kinds
        for seed in seeds
    ]
    runs = run_all(learn_hard, lessons, over, "hard cases")
    rows, first = [], []
    for k, (case, preferences) in enumerate(kinds):
        for group in zip(*runs[k * len(seeds) : (k + 1) * len(seeds)], strict=True):
            accuracy = [run.accuracy for run in group]
            first.append(group[0])
            rows.append(
                {
                    "case": case.name,
                    "size": case.world.n,
                    "trajectories": case.trajectories,
                    "state_preferences": preferences,
                    "queries": group[0].queries,
                    "state_query": state_query if group[0].queries else None,
                    "seeds": list(seeds),
                    "demonstrated_fraction": [run.demonstrated for run in group],
                    "accuracy": accuracy,
                    "interval": bootstrap_interval(np.array(accuracy), np.random.default_rng(0)),
                    "accuracy_shortest": [run.shortest for run in group],
                }
            )
    return rows, first
