"""A tutorial to read and to run: a grid, a task of one's own, and a learner that asks questions.

Run it whole with ``python -m experiments.tutorial`` (some seconds), or cell by cell in an editor
that knows ``# %%``. It needs the learning library ``irl`` and matplotlib, no robot. Pictures go to
``out/tutorial``.
"""
# ruff: noqa: E402 - each cell imports what it explains

# %% [markdown]
# ## 1. A grid in two minutes
#
# A cell of a grid is a *state*; right, up, left and down are the *actions*. Somebody knows where to
# go and shows the way from the four corners. Nobody tells the learner where the goal is, nor what
# is good about it: it sees the ways, and has to find out what they are ways *to*.
#
# A grid world comes with a *transition model*: which states follow when an action is taken in a
# state, and how probably. A move off the grid is not in it, so nobody can choose it.

# %%
from pathlib import Path

import numpy as np
import torch
from matplotlib.figure import Figure

from irl import Demonstrations, learn
from irl.domains.gridworld import MOVES, GridWorld, goal_cell

torch.set_num_threads(1)  # the networks are small: a second thread costs more than it brings
OUT = Path("out/tutorial")
OUT.mkdir(parents=True, exist_ok=True)

grid = GridWorld(9, goal_cell(9, "offset"))
print(f"{grid.model.n_states} states, {grid.model.n_pairs} pairs of a state and a feasible action")

# %% [markdown]
# *Demonstrations* are pairs of a state and the action that was taken there. Here are four ways, one
# from each corner.

# %%
ways = [
    Demonstrations.from_pairs(way, trajectory=number)
    for number, way in enumerate(grid.trajectories("diagonal"))
]
shown = Demonstrations.concatenate(ways)
print(f"{shown.n_states_demonstrated} of {grid.n_states} states demonstrated")

# %% [markdown]
# Now learn. `fa_mlirl` is the method of the thesis. It trains a network f, the *VR function*: f(s)
# is the reward for being in s plus the discounted value of going on from there. So f says how good
# it is to *arrive* in a state, and the value of an action is f averaged over where it leads:
# Q(s, a) = Σ P(s' | s, a) f(s'). The network is trained until the demonstrated actions are the
# likely ones.
#
# What the network sees of a state are its *features*, here x and y. All chance comes from `rng`:
# the same seed gives the same bits.

# %%
learnt = learn(
    "fa_mlirl", grid.model, shown, grid.features, gamma=0.95, rng=np.random.default_rng(0)
)
policy = learnt.q.argmax(axis=1)  # in every state the action of highest value
print(f"the goal is reached from {grid.accuracy(policy):.0%} of the cells")

# %% [markdown]
# The picture `grid.png` shows what was learnt: bright cells are good to arrive in, arrows are the
# policy, red ones were demonstrated. They meet in the goal, which nobody named.


# %%
def draw_grid(path: Path) -> None:
    """What a cell is worth on arrival, and the action chosen there."""
    figure = Figure(figsize=(5, 4.4), layout="constrained")
    axes = figure.subplots()
    value = learnt.reward + 0.95 * learnt.q.max(axis=1)  # f = R + γ V, with V the best Q
    image = axes.imshow(value.reshape(grid.n, grid.n), origin="lower", cmap="cividis")
    figure.colorbar(image, label="VR function f")
    here, move = grid.cells, MOVES[policy]
    for states, colour in ((slice(None), "white"), (shown.state, "red")):
        axes.quiver(*here[states].T, *move[states].T, color=colour, pivot="middle", scale=18)
    axes.plot(*grid.goal, "o", color="black", fillstyle="none", markersize=20)
    axes.set(xlabel="x", ylabel="y", title="Learnt from four ways (red); the goal is circled")
    figure.savefig(path, dpi=100)


draw_grid(OUT / "grid.png")

# %% [markdown]
# Every other method is called alike: see `irl.methods.METHODS` for their names.

# %%
for name in ("planning", "behaviour_cloning"):
    other = learn(name, grid.model, shown, grid.features, gamma=0.95, rng=np.random.default_rng(0))
    print(f"{name}: {grid.accuracy(other.q.argmax(axis=1)):.0%}")

# %% [markdown]
# ## 2. A task of one's own
#
# Any task will do that has finitely many states and actions. A plant is to be watered until it is
# ripe. A state is how far it has grown, how wet the soil is, and the weather:

# %%
from itertools import product

from irl import TransitionModel

STAGES = ("seed", "leaves", "flower", "ripe")
SOIL = ("dry", "moist", "wet")
SKY = ("sun", "rain")
ACTIONS = ("water", "wait")
STATES = list(product(STAGES, SOIL, SKY))
GROWS = {"dry": 0.0, "moist": 0.8, "wet": 0.2}  # probability to reach the next stage in a day

# %% [markdown]
# The transition model is a list of entries: state, action, next state, probability. Watering and
# rain each wet the soil by one step, sun dries it by one step on seven days of ten, and tomorrow is
# sunny in six cases of ten. A ripe plant stays ripe, and can only be left alone: an action that has
# no entry in a state cannot be done there.


# %%
def tomorrow(state: tuple[str, str, str], action: str) -> dict[tuple[str, str, str], float]:
    """Probability of each state that may follow."""
    stage, soil, sky = state
    grown, wet = STAGES.index(stage), SOIL.index(soil)
    after: dict[tuple[str, str, str], float] = {}
    for grows, dries, shines in product((True, False), repeat=3):
        probability = GROWS[soil] if grows else 1 - GROWS[soil]
        probability *= 0.7 if dries else 0.3
        probability *= 0.6 if shines else 0.4
        water = wet + (action == "water") + (sky == "rain") - (sky == "sun" and dries)
        result = (
            STAGES[min(grown + grows, 3)],
            SOIL[min(max(water, 0), 2)],
            SKY[not shines],
        )
        after[result] = after.get(result, 0.0) + probability
    return {result: probability for result, probability in after.items() if probability > 0}


entries = [
    (STATES.index(state), ACTIONS.index(action), STATES.index(result), probability)
    for state, action in product(STATES, ACTIONS)
    if not (state[0] == "ripe" and action == "water")
    for result, probability in tomorrow(state, action).items()
]
model = TransitionModel.from_entries(
    len(STATES), len(ACTIONS), *map(np.array, zip(*entries, strict=True))
)
print(f"{model.n_states} states, {model.n_pairs} pairs")

# %% [markdown]
# The network needs *features*: numbers of a size near 1. Here they are one number for each word, 1
# where the word applies and else 0, so that the network can see "wet" as a thing of its own and not
# only as more than "moist".

# %%
WORDS = (*STAGES, *SOIL, *SKY)
features = np.array([[float(word in state) for word in WORDS] for state in STATES])

# %% [markdown]
# To keep a task as a folder of files that every command reads, put the same arrays into a
# `TaskData` and save it: `experiments.own_task` does that.
#
# ## 3. Questions and advice: Algorithm 4.1
#
# A gardener shows one morning's work, no more. The learner trains on it, picks the state that it is
# *least certain* of, asks what to do there, trains on, and asks again. At times it asks about a
# whole *cluster* of states instead, and gets advice: actions to prefer or to avoid in all of them.
#
# What is known before anyone demonstrates is a `LearningProblem`. It has no goal and no reward.

# %%
from irl import LearningProblem

problem = LearningProblem(
    model,
    features,
    gamma=0.9,
    clusters={
        f"{soil} soil": np.array([k for k, state in enumerate(STATES) if state[1] == soil])
        for soil in SOIL
    },
)
first_morning = [
    (STATES.index(("seed", "dry", "sun")), ACTIONS.index("water")),
    (STATES.index(("seed", "moist", "rain")), ACTIONS.index("wait")),
]

# %% [markdown]
# The answers could be typed at a prompt. Here they are lists, so that this page runs by itself. Who
# demonstrates is any object with the two methods `label` and `trajectory`; who advises, any with
# the method `advise`. This person answers one state at a time, and says nothing about a ripe plant.

# %%
from irl import ClusterAdvice

ANSWERS = [  # soil, sky → what the gardener does
    ("dry", "sun", "water"),
    ("dry", "rain", "wait"),
    ("moist", "sun", "water"),
    ("moist", "rain", "wait"),
    ("wet", "sun", "wait"),
    ("wet", "rain", "wait"),
]
ADVICE = [("wet soil", "avoid", "water"), ("dry soil", "nothing", "")]


class Gardener:
    """Demonstrates and advises from a list of answers."""

    def label(self, state: int, rng: np.random.Generator) -> int:
        """The action to take in a state."""
        stage, soil, sky = STATES[state]
        (action,) = [do for wet, weather, do in ANSWERS if (wet, weather) == (soil, sky)]
        print(f"  What to do with a {stage} plant in {soil} soil, {sky}?  {action}")
        return ACTIONS.index(action)

    def trajectory(
        self, state: int, rng: np.random.Generator, max_steps: int = 50
    ) -> list[tuple[int, int]]:
        """The answer as pairs of state and action; none where there is nothing to do."""
        return [] if STATES[state][0] == "ripe" else [(state, self.label(state, rng))]

    def advise(self, cluster: str, states: np.ndarray) -> ClusterAdvice:
        """What to prefer or avoid throughout a cluster."""
        avoided = [
            ACTIONS.index(do) for name, say, do in ADVICE if (name, say) == (cluster, "avoid")
        ]
        print(f"  And in {cluster}?  {'never water' if avoided else 'it depends'}")
        return ClusterAdvice(avoided=frozenset(avoided))


# %% [markdown]
# Now the algorithm, with six rounds of questions. `ActiveConfig` holds its choices. Two of them are
# about how a network is trained: `beta` says how strictly the demonstrated actions are to be the
# best ones, and `bellman_weight` how much a simple reward is preferred, one that is nearly the same
# in every state, where no demonstration says otherwise.
#
# The callback is told of every training step, and of the action values `q` when a training is over.
# We know the aim, which the learner does not, so we can work out how good its policy is by then:
# the probability of a ripe plant within eight days.

# %%
from irl import ActiveConfig, Teacher, TrainingConfig, active_fa_mlirl, success_mdp
from irl.active import Progress

RIPE = np.array([k for k, state in enumerate(STATES) if state[0] == "ripe"])
START = np.array([STATES.index(("seed", "dry", "sun"))])
success: list[float] = []


def follow(progress: Progress) -> None:
    """Note how good the policy is after each training."""
    if progress.q is not None:
        success.append(success_mdp(model, progress.q.argmax(axis=1), RIPE, START, horizon=8))


gardener = Gardener()
result = active_fa_mlirl(
    problem,
    Demonstrations.from_pairs(first_morning),
    Teacher(gardener, gardener),
    ActiveConfig(
        initial=TrainingConfig(iterations=500, beta=10, bellman_weight=0.1),
        refine=TrainingConfig(iterations=300, beta=10, bellman_weight=0.1),
        budget=6,
        hidden=(32, 32),
    ),
    rng=np.random.default_rng(0),
    callback=follow,
)
print(f"ripe within eight days: {success[0]:.0%} before any question, {success[-1]:.0%} after six")

# %% [markdown]
# Is that good? The weather is not up to the gardener. Somebody who knows the aim can plan for it,
# and reaches the same share or nearly so:

# %%
from irl import OracleDemonstrator

planner = OracleDemonstrator(model, RIPE, gamma=0.9)
best = success_mdp(model, planner.optimal_actions.argmax(axis=1), RIPE, START, horizon=8)
print(f"ripe within eight days, planned with the aim known: {best:.0%}")


# %%
def draw_success(path: Path) -> None:
    """How the policy got better with the answers."""
    figure = Figure(figsize=(5, 3), layout="constrained")
    axes = figure.subplots()
    axes.plot(success, "o-", label="learnt")
    axes.axhline(best, color="black", linestyle="--", label="planned with the aim known")
    axes.set(xlabel="rounds of questions", ylabel="ripe within eight days", ylim=(0, 1))
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=100)


draw_success(OUT / "questions.png")

# %% [markdown]
# What was learnt is in `result`: the action values `q` with the advice in them, the VR function
# `f`, the network, all demonstrations and all advice, and one record for each question. To keep a
# policy, save it: `irl.policy.Policy.from_q(result.q, model.mask)`, then `irl.policy.save_policy`.
#
# Where to go on: `experiments.own_task` compares all methods on a task kept in files, and
# `experiments.demo` is this algorithm on 15,984 states, played by a robot arm.
