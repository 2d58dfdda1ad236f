"""One network's lesson in a grid-world."""

import time
from dataclasses import dataclass

import numpy as np
import torch

from irl.domains.gridworld import GridWorld
from irl.likelihood import LikelihoodProblem
from irl.preferences import StatePreferences
from irl.training import train
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction, torch_generator

EVALUATIONS = (12, 60)  # fewest and most points on an accuracy curve, dense where learning is fast
EVALUATED_CELLS = 1_000_000  # between the two, so many cells a curve


@dataclass(frozen=True)
class Learning:
    """How every network learns: one rule for all grids, goals and trajectories."""

    iterations: int
    step: float
    beta_per_cell: float
    hidden: tuple[int, ...]

    def training(self, n: int, share: float = 1.0) -> TrainingConfig:
        """For a grid of side n; with a share of the iterations, at least one."""
        iterations = max(1, round(share * self.iterations))
        return TrainingConfig(iterations, step=self.step, beta=self.beta_per_cell * n)


@dataclass(frozen=True)
class Lesson:
    """What one network is to learn, and from which random numbers."""

    world: GridWorld
    trajectories: str
    seed: int
    settings: Learning
    additive: bool = False
    state_preferences: bool = False


@dataclass(frozen=True)
class Run:
    """One network's story.

    Attributes:
        iteration: when its policy was judged.
        accuracy: how well it did then.
        shortest: share of the cells from which it takes a shortest way, at the end.
        f: float64 ``[n_states]``, what it learnt, without state preferences.
        policy: int8 ``[n_states]``, its policy at the end.
        seconds_per_iteration: of training alone, in time of the processor, so that a busy
            machine doesn't count; training takes one core.
        wall_s: wall time of all of it, the model and the judging included.
        cpu_s: the same in time of the processor.
    """

    iteration: list[int]
    accuracy: list[float]
    shortest: float
    f: np.ndarray
    policy: np.ndarray
    seconds_per_iteration: float
    wall_s: float
    cpu_s: float


def evaluations(n_states: int, iterations: int) -> set[int]:
    """After which iterations to judge the policy: fewer of them where that takes long."""
    number = int(np.clip(EVALUATED_CELLS // n_states, *EVALUATIONS))
    return set(np.geomspace(1, iterations, number).round().astype(int).tolist())


def learn(lesson: Lesson) -> Run:
    """Train one network, following its policy's accuracy along the way."""
    torch.set_num_threads(1)  # the networks are far too small to share
    world, settings = lesson.world, lesson.settings
    began, began_cpu = time.perf_counter(), time.process_time()
    rng = np.random.default_rng(lesson.seed)
    generator = torch_generator(rng)
    network = VRFunction(2, settings.hidden, generator=generator, additive=lesson.additive)
    problem = LikelihoodProblem.build(world.model, *world.demonstrations(lesson.trajectories))
    preferences = world.preferences() if lesson.state_preferences else StatePreferences()
    features = torch.as_tensor(world.features, dtype=torch.float32)

    def policy() -> np.ndarray:
        return policy_of(world, network.values(features), preferences)

    judged = evaluations(world.n_states, settings.iterations)
    iteration, accuracy, judging = [0], [world.accuracy(policy())], 0.0

    def watch(done: int, _: float) -> None:
        nonlocal judging
        if done in judged:
            entered = time.process_time()
            iteration.append(done)
            accuracy.append(world.accuracy(policy()))
            judging += time.process_time() - entered

    training_began = time.process_time()
    train(network, problem, features, settings.training(world.n), rng, watch)
    training = time.process_time() - training_began - judging
    f = network.values(features)
    final = policy_of(world, f, preferences)
    return Run(
        iteration=iteration,
        accuracy=accuracy,
        shortest=world.shortest(final),
        f=f,
        policy=final,
        seconds_per_iteration=training / settings.iterations,
        wall_s=time.perf_counter() - began,
        cpu_s=time.process_time() - began_cpu,
    )


def policy_of(world: GridWorld, f: np.ndarray, preferences: StatePreferences) -> np.ndarray:
    """The best action of every cell under f, advised by preferences: int8 ``[n_states]``."""
    return world.model.q_values(preferences.apply(f)).argmax(axis=1).astype(np.int8)
