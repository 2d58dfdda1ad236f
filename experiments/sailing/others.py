"""Other learners on the same lake, left out unless asked for: they plan at every step.

- ADVISE as in ``irl.baselines.action_advice``: advice is part of the objective, and what is learnt
  is a sparse reward, so that an answer reaches as far as the plan does. It is asked about the same
  clusters as FA-MLIRL, by Odom & Natarajan's own measure of uncertainty.
- Bayesian IRL as in ``irl.baselines.birl``: no advice, but the action in one state at a time, where
  the posterior leaves the policy most in doubt (Lopes, Melo & Montesano 2009) or at random.
"""

from collections.abc import Iterator

import numpy as np

from experiments.sailing.learning import Plan, Problem, ask, measure
from irl.baselines.action_advice import AdvisedLearner
from irl.baselines.birl import SamplingConfig, active_birl
from irl.demonstrations import Demonstrations
from irl.problem import LearningProblem

OTHERS = ("advise", "advise_random", "birl", "birl_random")
SAMPLING = SamplingConfig(beta=2.0, chains=2, burn_in=300, samples=100, thin=3)


def other_curves(
    plan: Plan, problem: Problem, shown: Demonstrations, seed: int
) -> dict[str, np.ndarray]:
    """Performance before the first query and after each, of every learner that is asked for.

    Returns:
        ``others/NAME`` → float64 ``[queries + 1]``. Bayesian IRL also has ``others/NAME/chains``
        ``[2]``: split-R̂ and effective samples after the last query, which say whether its chains
        agree, and how much they know.
    """
    result = {}
    for name in OTHERS:
        kind, _, random = name.partition("_")
        # One stream for both of a kind, so that they begin alike.
        rng = np.random.default_rng([seed, 30 if kind == "advise" else 31])
        if kind == "advise" and plan.advise_queries:
            learner = AdvisedLearner(problem.lake.model, shown, gamma=plan.gamma)
            queries = ask(problem, learner, problem.lake.sectors(), not random, rng)
            points = np.arange(plan.advise_queries + 1)
            result[f"others/{name}"], _ = measure(problem, learner, queries, points)
        if kind == "birl" and plan.birl_queries:
            told = np.array(list(_birl(plan, problem, shown, bool(random), rng)))
            # What is known last stands where every state has been asked about.
            told = told[np.minimum(np.arange(plan.birl_queries + 1), len(told) - 1)]
            result[f"others/{name}"], result[f"others/{name}/chains"] = told[:, 0], told[-1, 1:]
    return result


def _birl(
    plan: Plan, problem: Problem, shown: Demonstrations, random: bool, rng: np.random.Generator
) -> Iterator[tuple[float, float, float]]:
    """Performance, split-R̂ and effective samples before the first query and after each answer."""
    lake = problem.lake
    asked_about = LearningProblem(
        lake.model, lake.features, gamma=plan.gamma, candidates=np.flatnonzero(~lake.at_goal)
    )
    for posterior, _ in active_birl(
        asked_about,
        shown,
        problem.sailor,
        budget=plan.birl_queries,
        rng=rng,
        query="random" if random else "policy_entropy",
        config=SAMPLING,
    ):
        policy = lake.model.table(posterior.policy).argmax(axis=1)
        yield problem.performance(policy), posterior.r_hat, posterior.effective_samples
