"""Noisy data: runs that contradict each other teach every method, judged in the true world.

A random world, and a demonstrator who mostly errs: it chooses by chance, better actions more
often, and earns less than half of what could be earned. The learner gets its runs and nothing else:
the transition model is counted from the same moves, so that a pair never seen is absent and is
never chosen. What was learnt is worth what it earns in the true world, which allows every action;
in a state that was never seen nothing was learnt, and any action is taken there, each alike.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import torch
from tqdm import tqdm

from experiments.kit.command import Output, execute
from experiments.kit.method_plots import NAMES
from experiments.kit.options import LARGEST_SEED
from irl.active import ActiveConfig, active_fa_mlirl
from irl.baselines.birl import birl
from irl.choices import Limits, Members, Settings
from irl.demonstrations import Demonstrations
from irl.demonstrators import PolicyDemonstrator
from irl.evaluation import policy_value
from irl.mdp import TransitionModel
from irl.methods import METHODS, learn
from irl.outcomes import SoftPolicy
from irl.planning import uniform_policy, value_iteration
from irl.policy import Policy
from irl.problem import LearningProblem
from irl.records import from_moves
from irl.teacher import Teacher

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STATES, ACTIONS, REWARDED = 50, 8, 2
CONCENTRATION = 0.08  # of the Dirichlet that successors are drawn from: few, one mostly likely
BETA = 4.0  # the demonstrator takes a with probability ∝ exp(4 Q(s, a))
LONGEST = 51  # moves; the lengths of runs are drawn evenly
GAMMA = 0.9
ACTIVE = "active_fa_mlirl"
LEARNERS = (*METHODS, ACTIVE)


@dataclass(frozen=True)
class Config(Settings):
    """Learn from a demonstrator who mostly errs, with a model counted from its own moves."""

    seeds: Annotated[tuple[int, ...], Limits(0, LARGEST_SEED, some=True)] = (0, 1, 2, 3, 4)
    """The seeds: of each there is one world, its runs, and one lesson for each method."""
    seed: int = 0
    """A number that is added to each of the seeds."""
    runs: Annotated[int, Limits(1, 100_000)] = 819
    """How many runs are demonstrated, of 1 to 51 moves each."""
    methods: Annotated[tuple[str, ...], Members(LEARNERS)] = LEARNERS
    """Which methods are compared; active_fa_mlirl asks no questions."""
    out: Path = field(default_factory=lambda: Path("out/noisy"))
    """The folder that the results are written to."""


@dataclass(frozen=True, eq=False)
class World:
    """What is true, what was demonstrated, and what the learner makes a model of.

    Attributes:
        true: the transition model that runs are drawn from, every action feasible.
        reward: the true one, earned on entering a state, ``[n_states]``.
        optimum: the optimal value, a mean over the states.
        demonstrator: its probabilities ``[n_states, n_actions]``.
        model: counted from the moves.
        shown: the runs.
    """

    true: TransitionModel
    reward: np.ndarray
    optimum: float
    demonstrator: np.ndarray
    model: TransitionModel
    shown: Demonstrations

    @classmethod
    def drawn(cls, runs: int, rng: np.random.Generator) -> "World":
        """A world, its rewards and its runs, from any state to begin with, each alike."""
        successors = rng.dirichlet(np.full(STATES, CONCENTRATION), (STATES, ACTIONS))
        true = TransitionModel.from_dense(successors)
        reward = np.zeros(STATES)
        reward[rng.choice(STATES, REWARDED, replace=False)] = 1.0
        V, Q = value_iteration(true, reward, GAMMA)
        demonstrator = SoftPolicy.from_q(Q, true.mask, beta=BETA).probability
        moves = [_run(true, demonstrator, rng) for _ in range(runs)]
        model = counted(np.concatenate(moves))
        return cls(true, reward, float(V.mean()), demonstrator, model, from_moves(moves))

    def share(self, policy: np.ndarray) -> float:
        """What a policy earns in the true world, as a share of the optimal value.

        Args:
            policy: actions ``[n_states]``, −1 where nothing was learnt, or probabilities.
        """
        if policy.ndim == 1:
            acts = policy[:, None] == np.arange(ACTIONS)
            policy = uniform_policy(acts | (policy < 0)[:, None])
        return float(policy_value(self.true, policy, self.reward, GAMMA).mean() / self.optimum)

    def references(self) -> dict[str, float]:
        """What to compare shares with: the demonstrator, chance, and the true reward's own policy.

        The last plans for the true reward with the counted model: what the model lacks.
        """
        _, q = value_iteration(self.model, self.reward, GAMMA)
        return {
            "demonstrator": self.share(self.demonstrator),
            "chance": self.share(np.full((STATES, ACTIONS), 1 / ACTIONS)),
            "true_reward": self.share(Policy.from_q(q, self.model.mask).action),
        }


def _run(model: TransitionModel, policy: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Moves (state, action, next state) ``[n, 3]`` of one run."""
    state, moves = int(rng.integers(STATES)), []
    for _ in range(rng.integers(1, LONGEST + 1)):
        action = int(rng.choice(ACTIONS, p=policy[state]))
        after = model.sample(state, action, rng)
        moves.append((state, action, after))
        state = after
    return np.array(moves)


def counted(moves: np.ndarray) -> TransitionModel:
    """The transition model that moves ``[n, 3]`` amount to: how often each came about."""
    entries, count = np.unique(moves, axis=0, return_counts=True)
    state, action, after = entries.T
    tried = np.zeros((STATES, ACTIONS))
    np.add.at(tried, (state, action), count)
    share = count / tried[state, action]
    return TransitionModel.from_entries(STATES, ACTIONS, state, action, after, share)


def lesson(name: str, world: World, seed: int) -> dict[str, Any]:
    """Learn by one method as it comes; what ``result.json`` says of it.

    Features are one indicator a state. A linear program that finds no preference is asked again
    with what it names itself. Bayesian IRL tells the R̂ of its chains' log-likelihoods too.
    """
    problem = LearningProblem(world.model, np.eye(STATES), gamma=GAMMA)
    rng = np.random.default_rng(seed)
    note, r_hat = "", None
    changed: dict[str, Any] | None = None
    if name == "birl":
        posterior = birl(world.model, world.shown, gamma=GAMMA, rng=rng)
        _, q = value_iteration(world.model, posterior.reward, GAMMA)
        r_hat = posterior.r_hat
    elif name == ACTIVE:
        nobody = Teacher(PolicyDemonstrator(world.model, world.model.mask))
        q = active_fa_mlirl(problem, world.shown, nobody, ActiveConfig(budget=0), rng=rng).q
    else:
        learnt = learn(name, problem, world.shown, rng=rng)
        if learnt.lower:
            note, changed = learnt.note, dict(learnt.lower)
            learnt = learn(name, problem, world.shown, rng=rng, **changed)
        q, note = learnt.q, note or learnt.note
    share = world.share(Policy.from_q(q, world.model.mask).action)
    return {"share": share, "note": note, "changed": changed, "r_hat": r_hat}


def show(rows: list[dict[str, Any]], references: dict[str, list[float]]) -> None:
    """Print the table: of every method the share of the optimal value, in its worst seed first."""
    print(f"{'':18} {'worst':>6} {'mean':>6}  share of the optimal value in the true world")
    named = [(row["method"], row["share"], _remark(row)) for row in rows]
    named += [(f"({name})", shares, "") for name, shares in references.items()]
    for name, shares, remark in named:
        print(f"{name:18} {min(shares):6.1%} {np.mean(shares):6.1%}  {remark}".rstrip())


def _remark(row: dict[str, Any]) -> str:
    changed = [f"{k} = {v:.3g}" for told in row["changed"] if told for k, v in told.items()]
    if changed:
        return f"with {', '.join(changed)}, as it named itself"
    if row["r_hat"][0] is not None:
        return f"R̂ up to {max(row['r_hat']):.3f}"
    return ""


def draw(figure: "Figure", rows: list[dict[str, Any]], references: dict[str, list[float]]) -> None:
    """Draw a dot for every method and seed, beside what there is to compare with."""
    figure.set_size_inches(8, 0.36 * len(rows) + 2.4)
    axes = figure.subplots()
    names = [NAMES.get(row["method"], "active FA-MLIRL, not asking") for row in rows]
    styles = {"demonstrator": ("#ca0020", "--"), "chance": ("#7f7f7f", ":")}
    for name, (colour, style) in styles.items():
        axes.axvline(float(np.mean(references[name])), color=colour, ls=style, lw=1.2, label=name)
    axes.axvline(1.0, color="k", lw=1.2, label="optimum")
    for k, row in enumerate(rows):
        label = "what was learnt, a dot a seed" if k == 0 else None
        axes.plot(
            row["share"], [k] * len(row["share"]), "o", color="#2166ac", alpha=0.6, label=label
        )
    axes.set_yticks(range(len(rows)), names)
    axes.invert_yaxis()
    axes.set(xlim=(0, 1.05), xlabel="value in the true world, share of the optimal value")
    axes.grid(axis="x", alpha=0.3)
    axes.set_axisbelow(True)
    axes.set_title(interpretation(rows, references), fontsize=10)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)


def interpretation(rows: list[dict[str, Any]], references: dict[str, list[float]]) -> str:
    """What the picture says, in one sentence."""
    least = min(min(row["share"]) for row in rows)
    earned = np.mean(references["demonstrator"])
    return (
        f"The demonstrator earns {earned:.0%} of the optimal value;\n"
        f"what was learnt from its runs earns {least:.0%} or more."
    )


def main(config: Config, output: Output) -> dict[str, Any]:
    """Draw the worlds, learn each by every method, and judge it in the true world."""
    torch.set_num_threads(1)  # the networks are small
    seeds = [config.seed + s for s in config.seeds]
    worlds = [World.drawn(config.runs, np.random.default_rng(seed)) for seed in seeds]
    compared = [world.references() for world in worlds]
    references = {name: [each[name] for each in compared] for name in compared[0]}
    rows = []
    for name in tqdm(config.methods, desc="methods", leave=False):
        lessons = [lesson(name, *of) for of in zip(worlds, seeds, strict=True)]
        rows.append(
            {"method": name, **{key: [each[key] for each in lessons] for key in lessons[0]}}
        )
    show(rows, references)
    with output.figure("shares.png") as figure:
        draw(figure, rows, references)
    return {
        "seeds": seeds,
        "moves": [len(world.shown) for world in worlds],
        "pairs": [world.model.n_pairs for world in worlds],
        "rows": rows,
        "references": references,
    }


if __name__ == "__main__":
    execute(Config, main)
