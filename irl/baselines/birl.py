"""Bayesian inverse reinforcement learning, Ramachandran & Amir (2007), and its active queries.

A demonstrated action a in s has the probability exp(β Q*(s, a)) / Σ_b exp(β Q*(s, b)) under a
reward R = Φ ω (3.10), and every ω_k is Gaussian beforehand. Metropolis–Hastings draws rewards from
the posterior, in steps of its own shape (`irl.baselines.shape_of_posterior`). Successive
proposals are near each other, so planning for one starts from the last.

Lopes, Melo & Montesano (2009) ask where the posterior leaves the demonstrator's policy in doubt:
not where it is random, but where its probabilities differ from one likely reward to the next.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from irl.baselines.ascent import Callback
from irl.baselines.differentiable_planning import Planner
from irl.baselines.features import Features, reward_features
from irl.baselines.mcmc import Step, crank_nicolson, effective_sample_size, split_r_hat
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.baselines.shape_of_posterior import posterior_shape
from irl.choices import Limits, Settings, check_choice, check_range
from irl.demonstrations import Demonstrations
from irl.demonstrators import Demonstrator
from irl.errors import InputError
from irl.integers import reals
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel
from irl.problem import LearningProblem
from irl.queries import candidate_states

QUERIES = ("policy_entropy", "random")
R_HAT = 1.05
"""Up to which split-R̂ chains are taken to agree."""


@dataclass(frozen=True)
class SamplingConfig(Settings):
    """How to draw from the posterior."""

    beta: Annotated[float, Limits(0, 1e9, open_low=True)] = 10.0
    """Inverse temperature of the demonstrator, in 1 / unit of reward."""
    prior_scale: Annotated[float, Limits(0, 1e9, open_low=True)] = 1.0
    """Standard deviation of every ω_k beforehand, in the reward's unit."""
    chains: Annotated[int, Limits(2, 1000)] = 4
    """Independent chains; with fewer than 2, nothing tells whether they agree."""
    burn_in: Annotated[int, Limits(0, 1_000_000_000)] = 500
    """Proposals a chain in which its step adapts, which are forgotten."""
    samples: Annotated[int, Limits(4, 10_000_000)] = 200
    """Rewards a chain that are kept."""
    thin: Annotated[int, Limits(1, 1_000_000)] = 5
    """Proposals for each reward kept."""
    bins: Annotated[int, Limits(2, 10_000)] = 10
    """Intervals of the probabilities in ``Posterior.query_entropy``."""


@dataclass(frozen=True)
class Posterior:
    """Rewards drawn, and what they say of the policy.

    Attributes:
        model: the transition model.
        weights: ω, float64 ``[chains, samples, d]``.
        log_likelihood: of all demonstrations, ``[chains, samples]``.
        acceptance: share of proposals taken after the burn-in, ``[chains]``.
        reward: posterior mean of R, ``[n_states]``, earned on entering a state, or ``[n_pairs]``,
            earned by acting.
        counts: int64 ``[n_pairs, bins]``: how many of the rewards give each pair a probability
            in each interval.
        policy: posterior mean of π, ``[n_pairs]``.
    """

    model: TransitionModel
    weights: np.ndarray
    log_likelihood: np.ndarray
    acceptance: np.ndarray
    reward: np.ndarray
    counts: np.ndarray
    policy: np.ndarray

    @property
    def query_entropy(self) -> np.ndarray:
        """Doubt about the policy in each state, in nats, ``[n_states]``; Lopes et al., (7), (8).

        The entropy of a pair's histogram over intervals of its probability, as a mean over the
        state's feasible actions; 0 in states without.
        """
        share = self.counts / self.counts.sum(axis=1, keepdims=True)
        entropy = -(share * np.log(np.where(share > 0, share, 1.0))).sum(axis=1)
        return np.bincount(
            self.model.pair_state, entropy, minlength=self.model.n_states
        ) / np.maximum(self.model.widths, 1)

    @property
    def r_hat(self) -> float:
        """Split-R̂ of the log-likelihood, which is near 1 if the chains agree."""
        return float(split_r_hat(self.log_likelihood))

    @property
    def effective_samples(self) -> float:
        """Effective sample size of the log-likelihood."""
        return float(effective_sample_size(self.log_likelihood))


def birl(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    rng: np.random.Generator,
    config: SamplingConfig | None = None,
    start: np.ndarray | None = None,
    callback: Callback | None = None,
) -> Posterior:
    """Draw rewards from their posterior.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order, each one taken as evidence of its own.
        features: Φ, ``[n_states, d]``, or of pairs ``[n_states, n_actions, d]``; one indicator
            per state if absent.
        gamma: discount factor in [0, 1).
        rng: the only source of chance; each chain has a generator spawned from it.
        config: how to draw.
        start: where the chains begin, ``[chains, d]``; if absent, about the summit that a climb
            from a draw of the prior leads to.
        callback: told after each reward kept how many there are, of all chains together, and the
            log-likelihood of the last.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, a number is out of range,
            or the features or ``start`` are not finite or have a wrong shape.
    """
    config = config or SamplingConfig()
    phi, of_pairs = reward_features(model, features)
    problem = LikelihoodProblem.of(model, demonstrations)
    shape = config.chains, config.samples
    if start is not None:
        start = reals(start, "start")
        if start.shape != (config.chains, phi.shape[1]) or not np.isfinite(start).all():
            raise InputError(
                f"finite numbers {[config.chains, phi.shape[1]]} wanted, got {list(start.shape)}",
                place="start",
            )
    weights, likelihoods = np.empty((*shape, phi.shape[1])), np.empty(shape)
    acceptance = np.zeros(config.chains)
    counts = np.zeros((model.n_pairs, config.bins), dtype=np.int64)
    policy = np.zeros(model.n_pairs)
    pairs = np.arange(model.n_pairs)

    for chain, own_rng in enumerate(rng.spawn(config.chains)):
        # Errors of Q up to this change the log-likelihood by 1/500 at most.
        tolerance = 1e-3 / (config.beta * problem.total)
        planner = Planner(model, gamma, tolerance=tolerance, of_pairs=of_pairs)
        likelihood = PlannedLikelihood.over(problem, planner, config.beta)
        begin = None if start is None else start[chain]
        steps = _walk(likelihood, phi, problem.total, begin, config, own_rng)
        for sample in range(config.samples):
            for _ in range(config.thin):
                step = next(steps)
                acceptance[chain] += step.accepted / (config.samples * config.thin)
            weights[chain, sample], likelihoods[chain, sample], f = step.extra
            pi = np.exp(model.groups.log_softmax(config.beta * planner.q(f)))
            if callback is not None:
                callback(chain * config.samples + sample + 1, float(likelihoods[chain, sample]))
            policy += pi / (config.chains * config.samples)
            counts[pairs, np.minimum((pi * config.bins).astype(np.int64), config.bins - 1)] += 1
    reward = phi @ weights.mean(axis=(0, 1))
    return Posterior(model, weights, likelihoods, acceptance, reward, counts, policy)


def _walk(
    likelihood: PlannedLikelihood,
    phi: Features,
    labels: float,
    start: np.ndarray | None,
    config: SamplingConfig,
    rng: np.random.Generator,
) -> Iterator[Step[tuple[np.ndarray, float, np.ndarray]]]:
    """A chain in the coordinates of the posterior's own shape; extra: ω, its log-likelihood, f.

    It begins at ``start``, or else anywhere in that shape about the summit that a climb from a draw
    of the prior leads to: chains that find different summits do not agree.
    """
    size = (phi.shape[1],)
    foot = rng.normal(0.0, config.prior_scale, size) if start is None else start
    shape = posterior_shape(likelihood, phi, labels, config.prior_scale, foot)

    def density(z: np.ndarray) -> tuple[float, tuple[np.ndarray, float, np.ndarray]]:
        """Log posterior, less that of the shape."""
        omega = shape.at(z)
        f = likelihood.planner.solve(phi @ omega)
        value = labels * likelihood.of_values(f)[0]
        prior = omega @ omega / (2 * config.prior_scale**2)
        return value - prior + z @ z / 2, (omega, value, f)

    begin = rng.standard_normal(size) if start is None else shape.coordinates(start)
    return crank_nicolson(density, begin, 1.0, rng, config.burn_in)


def active_birl(
    problem: LearningProblem,
    demonstrations: Demonstrations,
    demonstrator: Demonstrator,
    *,
    budget: int,
    rng: np.random.Generator,
    query: str = "policy_entropy",
    config: SamplingConfig | None = None,
) -> Iterator[tuple[Posterior, Demonstrations]]:
    """Ask for the action in the state of largest ``query_entropy``, learn, and ask again.

    No labelled state is asked about. The loop ends early when no other is left.

    Args:
        problem: the transition model, gamma, Φ (one indicator per state if absent) and the states
            that questions stay within.
        demonstrations: what is known beforehand, at least one pair.
        demonstrator: answers with an action; must know the candidates.
        budget: most questions.
        rng: the only source of chance.
        query: a name in ``QUERIES``; ``random`` draws among the states evenly, for comparison.
        config: how to draw.

    Yields:
        The posterior before the first question and after each answer, and all demonstrations so
        far, answers last.

    Raises:
        InputError: as ``birl``, or if the budget is negative or the query's name unknown.
    """
    check_range("budget", budget, 0)
    check_choice("query", query, QUERIES)

    def learnt(start: np.ndarray | None) -> Posterior:
        model, features, gamma = problem.model, problem.features, problem.gamma
        return birl(
            model, demonstrations, features, gamma=gamma, rng=rng, config=config, start=start
        )

    posterior = learnt(None)
    yield posterior, demonstrations
    for _ in range(budget):
        left = candidate_states(problem.model, demonstrations.state, problem.candidates)
        if not left.size:
            return
        if query == "policy_entropy":
            doubt = posterior.query_entropy[left]
            left = left[doubt == doubt.max()]
        state = int(rng.choice(left))
        answer = Demonstrations.from_pairs(
            [(state, demonstrator.label(state, rng))],
            trajectory=int(demonstrations.trajectory.max()) + 1,
        )
        demonstrations = Demonstrations.concatenate([demonstrations, answer])
        # One answer moves the posterior little: the chains go on from where they are.
        posterior = learnt(posterior.weights[:, -1])
        yield posterior, demonstrations
