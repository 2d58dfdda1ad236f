"""Bring your own task: describe it, save it, learn it with every method, compare.

The task is a machine that makes a batch of parts and wears. Copy ``workshop``, replace what is the
machine's, and the rest works as it stands: nothing below it knows what the task is about.

What was learnt is judged twice: in the workshop where it was shown, and in one whose material is
brittle, of which nothing was shown. There a reward is planned for anew, and a policy that comes
without one stays as it is.

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
from experiments.kit.feature_plots import expected_visits, of_states, plot_over_features
from experiments.kit.method_plots import NAMES, Panel, names_of, plot_methods
from irl.choices import Limits, Members, Settings
from irl.collection import demonstrate
from irl.demonstrators import OracleDemonstrator
from irl.methods import METHODS, Learnt, learn
from irl.metrics import accuracy_optimal, success_mdp, unseen_states
from irl.planning import uniform_policy, value_iteration
from irl.policy import Policy, save_policy
from irl.task_data import TaskData, Transitions, load_task, save_task

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BRITTLE = {"fast": (0.5, 0.9), "slow": (0.9, 0.1)}
"""The paces where the material is brittle: fast breaks parts and wears the machine."""
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


def workshop(
    parts: int = 12,
    worn_out: int = 4,
    fast: tuple[float, float] = (0.9, 0.6),
    slow: tuple[float, float] = (0.7, 0.1),
) -> TaskData:
    """A machine makes parts, at a pace with a probability of a part, and of wear.

    Worn out, it must be serviced.
    """
    states = list(product(range(parts + 1), range(worn_out + 1)))  # (parts made, wear)
    actions = ["fast", "slow", "service", "rest"]
    entries = []
    for s, (made, wear) in enumerate(states):
        outcome = {}  # action → [(next state, probability)]; what is absent is infeasible
        if made == parts:
            outcome["rest"] = [((made, wear), 1.0)]
        elif wear > 0:
            serviced = 0.9 if wear < worn_out else 0.4
            outcome["service"] = [((made, 0), serviced), ((made, wear), 1 - serviced)]
        if made < parts and wear < worn_out:
            for name, (part, wears) in {"fast": fast, "slow": slow}.items():
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


def show(rows: list[dict[str, Any]], ceiling: float, changed: float) -> None:
    """Print the table."""
    print(f"{'method':18} {'':27} {'success':>8} {'as good':>8} {'brittle':>8} {'seconds':>8}")
    for row in rows:
        name = f"{row['method']:18} {NAMES[row['method']]:27}"
        if row["success_mdp"] is None:
            print(f"{name} {row['note']}")
            continue
        print(
            f"{name} {row['success_mdp']:8.1%} {row['accuracy_optimal_all']:8.1%} "
            f"{row['success_changed']:8.1%} {row['seconds']:8.2f}"
        )
    print(f"{'(demonstrator)':46} {ceiling:8.1%} {'':8} {changed:8.1%}")


def interpretation(rows: list[dict[str, Any]], ceiling: float, changed: float) -> str:
    """What the table says, in two sentences."""

    def far(key: str, best: float) -> tuple[int, str]:
        names = [row["method"] for row in rows if (row[key] or 0.0) < NEAR * best]
        return len(rows) - len(names), f"; {names_of(names)} do not" if names else ""

    (near, not_near), (kept, not_kept) = (
        far("success_mdp", ceiling),
        far("success_changed", changed),
    )
    return (
        f"{near} of {len(rows)} methods come to {NEAR:.0%} or more of the demonstrator's own "
        f"success, {ceiling:.0%}{not_near}. With brittle material, which nobody showed, {kept} do, "
        f"of {changed:.0%}{not_kept}."
    )


def draw(figure: "Figure", rows: list[dict[str, Any]], ceiling: float, changed: float) -> None:
    """Draw success, accuracy, success elsewhere and time of every method."""
    success, as_good, elsewhere = (
        [row[key] for row in rows]
        for key in ("success_mdp", "accuracy_optimal_all", "success_changed")
    )
    within = "probability within 20 actions"
    plot_methods(
        figure,
        [row["method"] for row in rows],
        [
            Panel("whole batch made", within, success, ceiling),
            Panel("acts as well as the demonstrator", "share of unseen states", as_good, 1.0),
            Panel("batch of brittle material made", within, elsewhere, changed),
        ],
        [row["seconds"] for row in rows],
        interpretation(rows, ceiling, changed),
    )


def draw_states(figure: "Figure", name: str, learnt: Learnt, task: TaskData) -> None:
    """Draw what a method learnt of every state: reward, value, and how often its policy is there.

    Args:
        figure: to draw on.
        name: of the method, which learnt a reward.
        learnt: by it.
        task: that it learnt.
    """
    assert learnt.reward is not None
    action = Policy.from_q(learnt.q, task.model.mask).action
    value = learnt.q.max(axis=1)
    plot_over_features(
        figure,
        task.feature("levels"),
        {
            "reward": of_states(learnt.reward, action),
            "value": np.where(np.isfinite(value), value, np.nan),
            "discounted visits": expected_visits(task.model, action, task.start_states, task.gamma),
        },
        f"What {NAMES[name]} learnt of each state, in units of its own reward",
        ("share of the batch made", "wear"),
    )


def carried_over(learnt: Learnt, action: np.ndarray, task: TaskData) -> np.ndarray:
    """What is done in another task: the best by the reward learnt, or else what was learnt to do.

    Args:
        learnt: by a method.
        action: its policy ``[n_states]``.
        task: of the same states and actions.
    """
    if learnt.reward is None:
        return action
    doubt = learnt.caution * task.model.surprise
    _, q = value_iteration(task.model, learnt.reward, task.gamma, pair_reward=-doubt)
    return Policy.from_q(q, task.model.mask).action


def main(config: Config, output: Output) -> dict[str, Any]:
    """Build, save and load the task; learn it with every method; judge each by the same measure.

    Success is the probability of a whole batch within 20 actions, over all starts. *As good* is the
    share of states not demonstrated in which the policy acts as well as the demonstrator. *Brittle*
    is the success where the material is. A method that found no preference has none of them: its
    ``note`` says what to do about it.

    Behaviour cloning is the best where nothing changes, with less work than any other: whether to
    make parts fast depends on wear and parts left in a way that a weighted sum of the two features
    tells, and then there is nothing to gain by knowing what it is good for. It is the worst where
    the paces change, for what the demonstrator *did* is wrong there and what it *wanted* is not.
    Rewards that were planned with as they were learnt carry over best. That of FA-MLIRL is read off
    its values (3.18), which the demonstrations tie to the old paces.
    """
    save_task(workshop(), output.folder / "task")
    task, changed = (
        load_task(output.folder / "task"),
        workshop(fast=BRITTLE["fast"], slow=BRITTLE["slow"]),
    )
    model, goal, starts = task.model, task.goal_states, task.start_states

    # Whoever knows the task: a person, a recording (task.demonstrations), or an oracle as here.
    teacher, judge = (
        OracleDemonstrator(t.model, goal, t.gamma, uncomfortable=t.cluster("worn out"))
        for t in (task, changed)
    )
    rng = np.random.default_rng(config.seed)
    shown = demonstrate(teacher, rng.choice(starts, config.trajectories), rng)
    unseen = unseen_states(model, starts, shown.state, teacher.terminal)

    torch.set_num_threads(1)  # the networks are small
    rows, with_reward = [], {}
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
        elsewhere: float | None = success_mdp(
            changed.model, carried_over(learnt, policy.action, changed), goal, starts
        )
        if learnt.no_preference:  # any policy would do, and so none says anything
            success = as_good = elsewhere = None
        elif learnt.reward is not None:
            with_reward[name] = learnt
        rows.append(
            {
                "method": name,
                "success_mdp": success,
                "accuracy_optimal_all": as_good,
                "success_changed": elsewhere,
                "seconds": learnt.seconds,
                "note": learnt.note,
            }
        )
    best, best_changed = (
        success_mdp(of.model, uniform_policy(of.optimal_actions), goal, starts)
        for of in (teacher, judge)
    )
    show(rows, best, best_changed)
    print(interpretation(rows, best, best_changed))
    with output.figure("methods.png") as figure:
        draw(figure, rows, best, best_changed)
    for name, learnt in list(with_reward.items())[:1]:  # one is enough to see how it is done
        with output.figure("states.png") as figure:
            draw_states(figure, name, learnt, task)
    return {
        "states": task.n_states,
        "demonstrated_fraction": shown.demonstrated_fraction(task.n_states),
        "unseen_states": unseen.size,
        "rows": rows,
        "success_mdp_oracle": best,
        "success_changed_oracle": best_changed,
    }


if __name__ == "__main__":
    execute(Config, main)
