"""An iteration of FA-MLIRL: against its arithmetic, against autograd, and as the grid grows.

Thesis §6.2's grid-worlds, of 49 and of 10,201 states, on one thread. An iteration is a step of
``irl.training.train``: f on the successors of demonstrated states, likelihood, gradient, Adam.
All times are the processor's, so that other work on the machine slows no side down by waiting.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from time import process_time
from typing import Any

import numpy as np
import torch

from experiments.bench.comparison import Peers, Row
from irl.domains.gridworld import GridWorld, goal_cell
from irl.likelihood import LikelihoodProblem
from irl.training import train
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction

SMALL, LARGE = 7, 101  # cells a side
NETWORKS = ((150, 50), (32, 32))  # the thesis', and the one of experiments.gridworld
STEP = 1e-3
ROUNDS = 12  # alternatives take turns, so that a busy spell of the machine hits all alike
CALLS = 60  # of an iteration a round; the fastest of all rounds counts
AUTOGRAD_CALLS = 4  # the same for the slow alternative


@dataclass(frozen=True)
class Case:
    """What is learnt: a grid, demonstrations, and the hidden widths of the network."""

    world: GridWorld
    state: np.ndarray
    action: np.ndarray
    hidden: tuple[int, ...]
    seed: int

    @classmethod
    def on(cls, n: int, trajectories: str, hidden: tuple[int, ...], seed: int) -> "Case":
        """The thesis' demonstrations on the n × n grid."""
        world = GridWorld(n, goal_cell(n, "centre"))
        return cls(world, *world.demonstrations(trajectories), hidden, seed)

    def thinned(self, n: int) -> "Case":
        """Keep ``n`` demonstrated pairs, evenly spread along the trajectories."""
        kept = np.linspace(0, self.state.size - 1, n).round().astype(np.int64)
        return Case(self.world, self.state[kept], self.action[kept], self.hidden, self.seed)

    @property
    def beta(self) -> float:
        """β = 10 n, as ``experiments.gridworld``."""
        return 10.0 * self.world.n

    def network(self) -> VRFunction:
        """The network before training, always the same."""
        generator = torch.Generator().manual_seed(self.seed)
        return VRFunction(2, self.hidden, generator=generator)

    def problem(self) -> LikelihoodProblem:
        """The demonstrations, prepared."""
        return LikelihoodProblem.build(self.world.model, self.state, self.action)


def fastest(work: Callable[[], object], calls: int) -> float:
    """Shortest processor time of ``work()`` [s]."""
    times = []
    for _ in range(calls):
        began = process_time()
        work()
        times.append(process_time() - began)
    return min(times)


def our_iteration(case: Case) -> Callable[[], float]:
    """Give a function that trains for ``CALLS`` iterations and tells the fastest's time [s]."""
    problem = case.problem()
    config = TrainingConfig(iterations=CALLS, step=STEP, schedule="none", beta=case.beta)

    def measure() -> float:
        times: list[float] = []
        network, rng = case.network(), np.random.default_rng(case.seed)
        features = case.world.features
        train(network, problem, features, config, rng, lambda *_: times.append(process_time()))
        return min(b - a for a, b in pairwise(times))

    return measure


def matrix_products(widths: Sequence[int], n: int) -> Callable[[], None]:
    """The matrix products of one iteration and nothing else: three a layer, two for the first.

    Args:
        widths: of the input, the hidden layers and the output.
        n: states whose f is needed.
    """
    work = []
    for k, (n_in, n_out) in enumerate(pairwise(widths)):
        weights, inputs = torch.rand(n_out, n_in + 1), torch.rand(n_in + 1, n)
        outputs, gradient = torch.rand(n_out, n), torch.empty(n_out, n_in + 1)
        work += [(weights, inputs, outputs), (outputs, inputs.T, gradient)]
        if k > 0:
            work.append((weights[:, :-1].T, outputs, torch.empty(n_in, n)))

    def multiply() -> None:
        for left, right, product in work:
            torch.mm(left, right, out=product)

    return multiply


class AutogradLearner:
    """The same iteration written plainly: f on *all* states, autograd, ``torch.optim.Adam``."""

    def __init__(self, case: Case) -> None:
        """Begin with the weights of ``case.network()``."""
        model = case.world.model
        arrays = case.network().arrays()
        layers: list[torch.nn.Module] = []
        for k, (n_in, n_out) in enumerate(pairwise((2, *case.hidden, 1))):
            linear = torch.nn.Linear(n_in, n_out)
            linear.weight.data = torch.from_numpy(arrays[f"0.{k}.weight"])
            linear.bias.data = torch.from_numpy(arrays[f"0.{k}.bias"])
            layers += [linear, torch.nn.ReLU()]
        self.network = torch.nn.Sequential(*layers[:-1], torch.nn.Tanh())
        self._optimizer = torch.optim.Adam(self.network.parameters(), lr=STEP)
        self._features = torch.as_tensor(case.world.features, dtype=torch.float32)
        entries = np.stack(model.P.nonzero())
        data = torch.as_tensor(model.P.data, dtype=torch.float32)
        self._P = torch.sparse_coo_tensor(
            torch.from_numpy(entries), data, model.P.shape, check_invariants=True
        ).coalesce()
        self._pair = (torch.as_tensor(model.pair_state), torch.as_tensor(model.pair_action))
        self._shown = (torch.from_numpy(case.state), torch.from_numpy(case.action))
        self._shape, self._beta = (model.n_states, model.n_actions), case.beta

    def step(self) -> float:
        """One iteration; the mean log-likelihood before it."""
        self._optimizer.zero_grad()
        q = torch.sparse.mm(self._P, self.network(self._features))[:, 0]
        table = torch.full(self._shape, -torch.inf).index_put(self._pair, self._beta * q)
        likelihood = torch.log_softmax(table, dim=1)[self._shown].mean()
        (-likelihood).backward()
        self._optimizer.step()
        return float(likelihood.detach())


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep PyTorch on one thread meanwhile."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def compare(trajectories: str, hidden: tuple[int, ...], seed: int) -> list[Row]:
    """The rows of one network and one kind of demonstrations."""
    large, small = (Case.on(n, trajectories, hidden, seed) for n in (LARGE, SMALL))
    # Of the large grid's cost, this is what the number of states alone is to blame for.
    few = large.thinned(small.state.size)
    cases = {"large": large, "small": small, "few": few}
    needed = {name: int(case.problem().states.size) for name, case in cases.items()}
    clocks = {name: our_iteration(case) for name, case in cases.items()}
    for name in ("large", "small"):
        products = matrix_products((2, *hidden, 1), needed[name])
        clocks[f"products, {name}"] = partial(fastest, products, CALLS)
    clocks["autograd"] = partial(fastest, AutogradLearner(large).step, AUTOGRAD_CALLS)
    rounds = [{name: clock() for name, clock in clocks.items()} for _ in range(ROUNDS)]
    time = {name: min(turn[name] for turn in rounds) for name in clocks}

    kind = f"iteration, {'–'.join(map(str, hidden))}, {trajectories}"
    work = f"{kind}, {large.world.n_states} states"
    smaller = f"itself on {small.world.n_states} states"

    def details(name: str) -> dict[str, Any]:
        return {
            "hidden": list(hidden),
            "trajectories": trajectories,
            "states": cases[name].world.n_states,
            "demonstrated_pairs": int(cases[name].state.size),
            "evaluated_states": needed[name],
        }

    growth = {"products_alone_ratio": time["products, small"] / time["products, large"]}
    # The limit is asked of the thesis' network alone: overheads outweigh small products.
    limit = 1 / 2.5 if hidden == NETWORKS[0] else None
    return [
        Row(work, time["large"], smaller, time["small"], 1 / 3, details("large") | growth),
        Row(
            *(f"{work}, {few.state.size} demonstrated", time["few"], smaller, time["small"]),
            wanted=1 / 3,
            details=details("few"),
        ),
        Row(
            *(work, time["large"], "its matrix products alone", time["products, large"]),
            wanted=limit,
            details=details("large"),
        ),
        Row(work, time["large"], "autograd on all states", time["autograd"], 10, details("large")),
    ]


def rows(_: Peers, seed: int) -> list[Row]:
    """Time both networks on both kinds of demonstrations; PyTorch itself is the alternative."""
    with one_thread():
        return [
            row
            for hidden in NETWORKS
            for trajectories in ("diagonal", "border")
            for row in compare(trajectories, hidden, seed)
        ]
