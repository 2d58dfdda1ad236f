"""The method ``fa_mlirl``: VR networks are fitted, and the likeliest of them is kept.

Where a network begins decides where its ascent of (3.19) ends, and a poor end shows in the
likelihood: on a slippery 51 × 51 grid networks that miss the goal's slopes explain the same walks
at half the log-likelihood. So several begin, each from weights of its own, and only how likely
each makes the demonstrations decides among them; nothing else is known of what is right.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from irl.bellman import BellmanTerm
from irl.choices import Limits, Settings, check_choice, made
from irl.likelihood import LikelihoodProblem
from irl.method_inputs import Found, Inputs, inverse_temperature
from irl.method_iterations import HIDDEN
from irl.training import train
from irl.training_config import TrainingConfig
from irl.vr_function import DEVICES, WIDEST, VRFunction, pin, torch_generator

NETWORKS = 3
"""How many networks begin: one in eighteen ends poorly, so that all three do is rare."""


@dataclass(frozen=True)
class NetworksConfig(Settings):
    """Which networks are fitted, and how."""

    hidden: Annotated[tuple[int, ...], Limits(1, WIDEST)] = HIDDEN
    """Widths of the hidden layers."""
    training: TrainingConfig | Mapping[str, Any] | None = None
    """How each is trained, or the fields of that; None for the defaults, β by the walks' length."""
    networks: Annotated[int, Limits(1, 1000)] = NETWORKS
    """How many begin."""
    device: str = "cpu"
    """Where they live, a name in ``irl.vr_function.DEVICES``."""

    def __post_init__(self) -> None:
        """Refuse values outside their range.

        Raises:
            InputError: naming the field and what it may be.
        """
        super().__post_init__()
        check_choice("device", self.device, DEVICES)


def likeliest(given: Inputs, **options: Any) -> Found:
    """Fit VR networks, each by the same training, and keep the likeliest; `NetworksConfig`.

    The first begins as the only one would. Progress is told over all of them, one after the other;
    what has converged is the one that is kept, and nothing is said of it without a tolerance.
    """
    config, model = NetworksConfig(**options), given.model
    x, fixed_vr = given.problem.required_features(), given.problem.fixed_vr
    if config.training is None:
        training = TrainingConfig(beta=inverse_temperature(given.demonstrations))
    else:
        training = made(TrainingConfig, config.training, "training")
    cautious = training.cautious
    problem = LikelihoodProblem.of(
        model, given.demonstrations, fixed_vr=fixed_vr, cautious=cautious
    )
    bellman = None
    if training.bellman_weight > 0:
        bellman = BellmanTerm(
            model,
            given.gamma,
            fixed_vr,
            batch=training.bellman_batch,
            delta=training.bellman_delta,
            cautious=cautious,
        )
    best, f, caution, done = -np.inf, np.zeros(model.n_states), 0.0, 0
    settled: bool | None = None

    def told(iteration: int, value: float) -> None:
        if given.progress is not None:
            given.progress(done + iteration, value)

    for _ in range(config.networks):
        network = VRFunction(
            x.shape[1],
            tuple(config.hidden),
            generator=torch_generator(given.rng),
            device=config.device,
        )
        run = train(network, problem, x, training, given.rng, told, bellman)
        done += run.log_likelihood.size
        values = pin(network.values(x), fixed_vr)
        seen = np.append(values, -run.caution)[problem.states]
        likelihood, _, _ = problem.value_and_gradient(seen, run.beta)
        if likelihood > best:
            best, f, caution = likelihood, values, run.caution
            settled = run.converged if training.tolerance > 0 else None
    q = model.q_values(f, caution)
    V = np.where(model.mask.any(axis=1), q.max(axis=1), 0.0)
    reward = f - given.gamma * V  # by (3.18)
    return Found(reward, q, iterations=done, converged=settled)
