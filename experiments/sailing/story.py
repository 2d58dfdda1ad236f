"""Sailing: how many questions to an expert a learner needs (thesis §6.1, Figures 6.1, 6.2).

A learner has seen few trajectories and may ask an expert which legs to prefer and which to avoid.
One query is one question, about one state or about one cluster of states. The expert prefers
actions that are optimal in at least ``prefer_share`` of the cluster, and avoids those that are so
in at most ``avoid_share``; neither need hold in each of its states.

- *random advice* asks about a state drawn at random: advice about whatever comes up;
- *uncertain state* asks about the state of highest entropy (4.1);
- *uncertain cluster* asks about the cluster of highest mean entropy;
- *random cluster* tells what is owed to the clusters from what is owed to the choice.

Clusters are what a sailor would name: the wind, and where the goal lies from here. Performance is
the expected discounted time to the goal, over all starts, on the scale from 0, any feasible leg
at random, to 1, the optimal policy.

Advice changes the action values, as in Algorithm 4.1; then it reaches no further than the states
it was given for. For comparison all is repeated with advice in the objective as well, where an
answer about one state teaches about others through the features.

``--advise-queries N`` and ``--birl-queries N`` let other learners ask as well: ADVISE (Odom &
Natarajan 2016), and Bayesian IRL with active queries (Lopes, Melo & Montesano 2009), which asks for
actions instead of advice; see ``experiments.sailing.others``. Both plan at every step, so a query
takes seconds.

The noise experiment follows Kunapuli et al. (2013): a share of the demonstrated labels is wrong,
and the learner has no advice, good advice, or advice that is wrong equally often.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS, run_all, start_workers
from experiments.sailing.learning import (
    NOISE_CURVES,
    STRATEGIES,
    Learner,
    Plan,
    ask,
    run_seed,
)
from experiments.sailing.others import OTHERS, other_curves
from experiments.sailing.plots import (
    plot_advice,
    plot_clustering,
    plot_lake,
    plot_noise,
    plot_others,
)
from irl.choices import Limits
from irl.domains.sailing import DIRECTIONS, ideal_clusters, purity
from irl.metrics import bootstrap_interval

RESAMPLES = 2000
LAKE_WIND = DIRECTIONS.index("SE")  # in the picture: across the way to the goal


@dataclass(frozen=True)
class Config(Plan):
    """Seek advice about sailing, and count the questions."""

    seeds: Annotated[int, Limits(2, 1_000_000)] = 20
    """How many independent runs there are: other demonstrations, queries and ties."""
    seed: int = 0
    """The first of their seeds."""
    target: Annotated[float, Limits(0, 1)] = 0.95
    """The performance whose price in queries is reported."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes; the results do not depend on it."""
    out: Path = field(default_factory=lambda: Path("out/sailing"))
    """The folder that the results are written to."""


def plan_of(config: Config) -> Plan:
    """The part that shapes a run."""
    return Plan(**{field.name: getattr(config, field.name) for field in fields(Plan)})


def run_seeds(plan: Plan, seeds: Sequence[int], workers: int) -> list[dict[str, np.ndarray]]:
    """Every seed's curves, in the order of the seeds."""
    # Matrices are small: a second BLAS thread would only get in another worker's way.
    os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    with start_workers(workers) as pool:
        return run_all(partial(run_everything, plan), seeds, pool.executor.map, "seeds", "seed")


def run_everything(plan: Plan, seed: int) -> dict[str, np.ndarray]:
    """One seed's curves, those of the other learners included."""
    problem = plan.problem
    shown = problem.demonstrate(plan.demonstrations, np.random.default_rng([seed, 0]))
    return run_seed(plan, seed) | other_curves(plan, problem, shown, seed)


def curve(x: Sequence[float] | np.ndarray, values: np.ndarray) -> list[list[float]]:
    """Rows [x, mean, low, high] with bootstrap intervals of values ``[seeds, len(x)]``."""
    rows = []
    for at, column in zip(x, values.T, strict=True):
        low, high = bootstrap_interval(column, np.random.default_rng(0), resamples=RESAMPLES)
        rows.append([float(at), float(column.mean()), low, high])
    return rows


def first_reached(points: np.ndarray, mean: np.ndarray, target: float) -> np.ndarray:
    """The points at which curves ``[…, len(points)]`` first reach the target; inf if none."""
    reached = mean >= target
    return np.where(reached.any(axis=-1), points[reached.argmax(axis=-1)], np.inf)


def queries_to_target(
    points: np.ndarray, performance: dict[str, np.ndarray], target: float
) -> dict[str, dict[str, Any]]:
    """How many queries each strategy's mean curve takes to the target.

    Args:
        points: numbers of queries, ascending.
        performance: strategy → ``[seeds, len(points)]``, the uncertain cluster among them.
        target: the performance.

    Returns:
        strategy → ``queries`` and its bootstrap interval ``low``, ``high`` (seeds drawn anew, the
        same ones for all strategies), null if not reached within the budget; ``ratio`` is the
        uncertain cluster's queries over this strategy's, with ``ratio_low``, ``ratio_high``.
        Where this strategy runs out of budget, the budget stands in, so that a ratio errs
        upwards; where the uncertain cluster does, there is no ratio.
    """
    seeds = len(performance["uncertain_cluster"])
    draws = np.random.default_rng(0).integers(seeds, size=(RESAMPLES, seeds))
    samples = {
        name: np.concatenate([values.mean(axis=0)[None], values[draws].mean(axis=1)])
        for name, values in performance.items()
    }
    needed = {name: first_reached(points, means, target) for name, means in samples.items()}
    ours = needed["uncertain_cluster"]

    def told(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    result = {}
    for name, queries in needed.items():
        ratio = ours / np.clip(queries, 1, points[-1])
        entry = {"queries": queries[0], "ratio": ratio[0]}
        for field_, values in (("", queries[1:]), ("ratio_", ratio[1:])):
            # Quantiles that are samples themselves: infinity has no neighbours to average with.
            ends = np.quantile(values, [0.025, 0.975], method="inverted_cdf")
            entry |= {f"{field_}low": ends[0], f"{field_}high": ends[1]}
        result[name] = {key: told(value) for key, value in entry.items()}
    return result


def clustering_result(plan: Plan, runs: list[dict[str, np.ndarray]], most: int) -> dict[str, Any]:
    """Figure 6.2's numbers up to ``most`` queries: a curve a quality, and each over the ideal."""
    points = plan.points[plan.points <= most]
    pure = np.mean([run["purity"] for run in runs], axis=0)
    by_quality = [
        np.array([run[f"quality/{i}"][: points.size] for run in runs])
        for i in range(len(plan.qualities))
    ]
    averages = np.stack([values[:, 1:].mean(axis=1) for values in by_quality], axis=1)
    return {
        "levels": [
            {"quality": quality, "purity": float(p), "curve": curve(points, values)}
            for quality, p, values in zip(plan.qualities, pure, by_quality, strict=True)
        ],
        "relative_to_ideal": curve(pure, averages / averages[:, :1]),
        "queries": int(points[-1]),
    }


def others_result(runs: list[dict[str, np.ndarray]]) -> dict[str, Any]:
    """Curves of the other learners, and whether Bayesian IRL's chains agree; empty without any.

    ``other_chains`` gives split-R̂ and effective samples after the last query, of each seed.
    """
    found = {
        name: np.array([run[f"others/{name}"] for run in runs])
        for name in OTHERS
        if f"others/{name}" in runs[0]
    }
    if not found:
        return {}
    chains = {
        name: {
            "r_hat": [float(run[f"others/{name}/chains"][0]) for run in runs],
            "effective_samples": [float(run[f"others/{name}/chains"][1]) for run in runs],
        }
        for name in found
        if f"others/{name}/chains" in runs[0]
    }
    curves = {name: curve(np.arange(values.shape[1]), values) for name, values in found.items()}
    return {"other_curves": curves, "other_chains": chains}


def learned_policies(plan: Plan, seed: int) -> dict[str, np.ndarray]:
    """One seed's policies before and after advice, for the picture of the lake."""
    problem = plan.problem
    shown = problem.demonstrate(plan.demonstrations, np.random.default_rng([seed, 0]))
    learner = Learner(problem.lake, shown, plan.l2, objective=False)
    policies = {f"{plan.demonstrations} demonstrations": learner.policy}
    queries = ask(problem, learner, problem.lake.sectors(), True, np.random.default_rng(seed))
    for number in islice(queries, plan.noise_queries):
        last = number
    return {
        **policies,
        f"and {last} cluster queries": learner.policy,
        "optimal": problem.sailor.optimal_actions.argmax(axis=1),
    }


def main(config: Config, output: Output) -> dict[str, Any]:
    """Run every seed, tabulate, plot."""
    plan = plan_of(config)
    problem = plan.problem
    seeds = range(config.seed, config.seed + config.seeds)
    runs = run_seeds(plan, seeds, config.workers)

    def curves(suffix: str, points: np.ndarray) -> dict[str, list[list[float]]]:
        return {
            name: curve(points, np.array([run[name + suffix] for run in runs]))
            for name in STRATEGIES
        }

    def price(suffix: str, points: np.ndarray) -> dict[str, dict[str, Any]]:
        performance = {name: np.array([run[name + suffix] for run in runs]) for name in STRATEGIES}
        return queries_to_target(points, performance, config.target)

    sectors, optimal = problem.lake.sectors(), problem.sailor.optimal_actions
    ideal = ideal_clusters(optimal, problem.lake.states[:, 2])
    result: dict[str, Any] = {
        "curves": curves("", plan.points),
        "goal_curves": curves("/goal", plan.points),
        "objective_curves": curves("/objective", plan.objective_points),
        "target": config.target,
        "queries_to_target": price("", plan.points),
        "objective_queries_to_target": price("/objective", plan.objective_points),
        "clustering_curves": clustering_result(plan, runs, np.unique(ideal[ideal >= 0]).size),
        "noise": {
            name: curve(config.noise, np.array([run[f"noise/{name}"] for run in runs]))
            for name in NOISE_CURVES
        },
        "clusters": np.unique(sectors[sectors >= 0]).size,
        "cluster_purity": purity(sectors, optimal),
        "minutes_random": problem.scale[0],
        "minutes_optimal": problem.scale[1],
        "states": problem.lake.n_states,
        "seeds": list(seeds),
    }
    if others := others_result(runs):
        result |= others
        with output.figure("other_learners.png") as figure:
            ours = result["objective_curves"]["uncertain_cluster"]
            plot_others(figure, result["other_curves"], ours, config.target)
    with output.figure("figure_6_1.png") as figure:
        plot_advice(figure, result["curves"], result["objective_curves"], config.target)
    with output.figure("figure_6_2.png") as figure:
        plot_clustering(figure, result["clustering_curves"])
    with output.figure("noise.png") as figure:
        plot_noise(figure, result["noise"], config.noise_queries)
    with output.figure("policy.png") as figure:
        plot_lake(figure, problem.lake, learned_policies(plan, config.seed), LAKE_WIND, optimal)
    for name, entry in result["queries_to_target"].items():
        needed = "more than all" if entry["queries"] is None else f"{entry['queries']:.0f}"
        print(f"{name:>18}: {needed} queries to performance {config.target}")
    return result
