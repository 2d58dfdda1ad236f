"""Bring your own task: describe it, save it, learn it with every method, compare.

The task is a machine that makes a batch of parts and wears. Copy ``workshop``, replace what is the
machine's, and the rest works as it stands: nothing below it knows what the task is about.

.. include:: own_task.md

.. include:: own_data.md
"""

from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import torch
from tqdm import tqdm

from experiments.kit.command import Output, execute
from experiments.kit.method_plots import NAMES, Panel, names_of, plot_methods
from irl.choices import Limits, Members, Settings
from irl.collection import demonstrate
from irl.demonstrators import OracleDemonstrator
from irl.methods import METHODS, learn
from irl.metrics import accuracy_optimal, success_mdp, unseen_states
from irl.planning import uniform_policy
from irl.policy import Policy, save_policy
from irl.task_data import TaskData, Transitions, load_task, save_task

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEAR = 0.9
"""A success of this share of the demonstrator's counts as near it."""


@dataclass(frozen=True)
class Config(Settings):
    """Learn a small task of another kind than the robot's, with every method."""

    seed: int = 0
    """The seed of the demonstrations and of the methods."""
    trajectories: Annotated[int, Limits(1, 100_000)] = 8
    """How many batches are demonstrated."""
    methods: Annotated[tuple[str, ...], Members(tuple(METHODS))] = tuple(METHODS)
    """Which methods are compared."""
    out: Path = field(default_factory=lambda: Path("out/own_task"))
    """The folder that the results are written to, the task data into its folder task."""


def workshop(parts: int = 12, worn_out: int = 4) -> TaskData:
    """A machine makes parts, fast or slowly, and wears; worn out, it must be serviced."""
    states = list(product(range(parts + 1), range(worn_out + 1)))  # (parts made, wear)
    actions = ["fast", "slow", "service", "rest"]
    pace = {"fast": (0.9, 0.6), "slow": (0.7, 0.1)}  # probability of a part, and of wear
    entries = []
    for s, (made, wear) in enumerate(states):
        outcome = {}  # action → [(next state, probability)]; what is absent is infeasible
        if made == parts:
            outcome["rest"] = [((made, wear), 1.0)]
        elif wear > 0:
            serviced = 0.9 if wear < worn_out else 0.4
            outcome["service"] = [((made, 0), serviced), ((made, wear), 1 - serviced)]
        if made < parts and wear < worn_out:
            for name, (part, wears) in pace.items():
                outcome[name] = [
                    ((made + i, wear + j), (part if i else 1 - part) * (wears if j else 1 - wears))
                    for i, j in product((0, 1), (0, 1))
                ]
        for name, results in outcome.items():
            entries += [(s, actions.index(name), states.index(t), p) for t, p in results]
    state, action, next_state, probability = map(np.array, zip(*entries, strict=True))
    made, wear = np.array(states).T
    return TaskData(
        name="workshop",
        states=[{"made": str(m), "wear": str(w)} for m, w in states],
        actions=[{"name": name} for name in actions],
        transitions=Transitions.estimated(state, action, next_state, probability),
        goal_states=np.flatnonzero(made == parts),
        start_states=np.flatnonzero(made == 0),
        gamma=0.95,
        features={"levels": np.stack([made / parts, wear / worn_out], axis=1)},
        clusters={"worn out": np.flatnonzero(wear == worn_out)},
        preferred=np.flatnonzero(made == parts),
        avoided=np.flatnonzero((wear == worn_out) & (made < parts)),
    )


def show(rows: list[dict[str, Any]], ceiling: float) -> None:
    """Print the table."""
    print(f"{'method':18} {'':27} {'success':>8} {'as good':>8} {'seconds':>8}")
    for row in rows:
        name = f"{row['method']:18} {NAMES[row['method']]:27}"
        if row["success_mdp"] is None:
            print(f"{name} {row['note']}")
            continue
        print(
            f"{name} {row['success_mdp']:8.1%} {row['accuracy_optimal_all']:8.1%} "
            f"{row['seconds']:8.2f}"
        )
    print(f"{'(demonstrator)':46} {ceiling:8.1%}")


def interpretation(rows: list[dict[str, Any]], ceiling: float) -> str:
    """What the table says, in one sentence."""
    far = [row["method"] for row in rows if (row["success_mdp"] or 0.0) < NEAR * ceiling]
    return (
        f"{len(rows) - len(far)} of {len(rows)} methods come to {NEAR:.0%} or more of the "
        f"demonstrator's own success, {ceiling:.0%}"
        f"{f'; {names_of(far)} do not' if far else ''}."
    )


def draw(figure: "Figure", rows: list[dict[str, Any]], ceiling: float) -> None:
    """Draw success, accuracy and time of every method."""
    success = [row["success_mdp"] for row in rows]
    as_good = [row["accuracy_optimal_all"] for row in rows]
    plot_methods(
        figure,
        [row["method"] for row in rows],
        [
            Panel("whole batch made", "probability within 20 actions", success, ceiling),
            Panel("acts as well as the demonstrator", "share of unseen states", as_good, 1.0),
        ],
        [row["seconds"] for row in rows],
        interpretation(rows, ceiling),
    )


def main(config: Config, output: Output) -> dict[str, Any]:
    """Build, save and load the task; learn it with every method; judge each by the same measure.

    Success is the probability of a whole batch within 20 actions, over all starts. *As good* is the
    share of states not demonstrated in which the policy acts as well as the demonstrator. A method
    that found no preference has neither: its ``note`` says what to do about it.
    """
    save_task(workshop(), output.folder / "task")
    task = load_task(output.folder / "task")
    model, goal, starts = task.model, task.goal_states, task.start_states

    # Whoever knows the task: a person, a recording (task.demonstrations), or an oracle as here.
    teacher = OracleDemonstrator(model, goal, task.gamma, uncomfortable=task.cluster("worn out"))
    rng = np.random.default_rng(config.seed)
    shown = demonstrate(teacher, rng.choice(starts, config.trajectories), rng)
    unseen = unseen_states(model, starts, shown.state, teacher.terminal)

    torch.set_num_threads(1)  # the networks are small
    rows = []
    for name in tqdm(config.methods, desc="methods", leave=False):
        learnt = learn(
            name,
            model,
            shown,
            task.feature("levels"),
            gamma=task.gamma,
            rng=np.random.default_rng(config.seed),
        )
        policy = Policy.from_q(
            learnt.q, model.mask, task_hash=task.task_hash, algorithm=name, seed=config.seed
        )
        save_policy(policy, output.folder / f"{name}.safetensors")
        success: float | None = success_mdp(model, policy.action, goal, starts)
        as_good: float | None = accuracy_optimal(
            policy.action, unseen, teacher.optimal_actions
        ).value
        if learnt.no_preference:  # any policy would do, and so none says anything
            success = as_good = None
        rows.append(
            {
                "method": name,
                "success_mdp": success,
                "accuracy_optimal_all": as_good,
                "seconds": learnt.seconds,
                "note": learnt.note,
            }
        )
    ceiling = success_mdp(model, uniform_policy(teacher.optimal_actions), goal, starts)
    show(rows, ceiling)
    print(interpretation(rows, ceiling))
    with output.figure("methods.png") as figure:
        draw(figure, rows, ceiling)
    return {
        "states": task.n_states,
        "demonstrated_fraction": shown.demonstrated_fraction(task.n_states),
        "unseen_states": unseen.size,
        "rows": rows,
        "success_mdp_oracle": ceiling,
    }


if __name__ == "__main__":
    execute(Config, main)
