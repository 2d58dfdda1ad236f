"""The baselines as methods: from what every method is given to what it found.

Each takes the settings of its baseline, one by one, and counts iterations on the way. The linear
programs are in `irl.linear_programs`, ``fa_mlirl`` is in `irl.vr_fit`.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from irl.baselines.ascent import AscentConfig, RidgeConfig
from irl.baselines.behaviour_cloning import behaviour_cloning
from irl.baselines.birl import R_HAT, SamplingConfig, birl
from irl.baselines.deep_max_ent import DeepMaxEntConfig, deep_max_ent
from irl.baselines.max_ent import max_ent
from irl.baselines.sparse_planning import SparseConfig, sparse_planning
from irl.caution import learn_caution
from irl.choices import made
from irl.method_inputs import Count, Found, Inputs, demonstrated
from irl.posterior.learner import AGREE, GoalConfig, GoalLearner


def counted(
    function: Callable[..., tuple[np.ndarray, Any]], config_type: type[AscentConfig]
) -> Callable:
    """Fit by ``function``, which tells a callback of its iterations: a reward per state, or Φ ω."""

    def fit(given: Inputs, **options: Any) -> Found:
        count, config = Count(given.progress), config_type(**options)
        reward, _ = function(
            given.model,
            given.demonstrations,
            given.problem.pair_features,
            gamma=given.gamma,
            config=config,
            callback=count,
        )
        return Found(reward, iterations=count.done, converged=count.done < config.max_iterations)

    return fit


def planned(given: Inputs, **options: Any) -> Found:
    """Fit by ``planning``; options as `SparseConfig`."""
    found, problem = counted(sparse_planning, SparseConfig)(given, **options), given.problem
    if problem.pair_features is not None:  # then the reward itself can say what is minded
        return found
    caution = learn_caution(problem.model, given.demonstrations, found.reward, problem.gamma)
    return replace(found, caution=caution)


def matched(given: Inputs, **options: Any) -> Found:
    """Fit by ``max_ent``; options as `RidgeConfig`."""
    shown = demonstrated(given.demonstrations)
    return counted(max_ent, RidgeConfig)(replace(given, demonstrations=shown), **options)


def matched_by_network(given: Inputs, **options: Any) -> Found:
    """Fit by ``deep_max_ent``; options as `DeepMaxEntConfig`."""
    config, pairs = DeepMaxEntConfig(**options), given.problem.pair_features
    reward, _ = deep_max_ent(
        given.model,
        demonstrated(given.demonstrations),
        given.problem.required_features() if pairs is None else pairs,
        gamma=given.gamma,
        rng=given.rng,
        config=config,
        callback=given.progress,
    )
    return Found(reward, iterations=config.iterations)


def sampled(
    given: Inputs, sampling: SamplingConfig | Mapping[str, Any] | None = None, **options: Any
) -> Found:
    """Fit by ``birl``; ``sampling``, or its fields by name, other options as `birl`."""
    settings = made(SamplingConfig, sampling, "sampling")
    posterior = birl(
        given.model,
        given.demonstrations,
        given.problem.pair_features,
        gamma=given.gamma,
        rng=given.rng,
        config=settings,
        callback=given.progress,
        **options,
    )
    proposals = settings.chains * (settings.burn_in + settings.samples * settings.thin)
    agree = posterior.r_hat <= R_HAT
    note = f"chains disagree: R̂ = {posterior.r_hat:.3f}, above {R_HAT}; raise burn_in and samples"
    return Found(
        posterior.reward, iterations=proposals, converged=agree, note="" if agree else note
    )


def cloned(given: Inputs, **options: Any) -> Found:
    """Fit by ``behaviour_cloning``; options as `RidgeConfig`."""
    count, config = Count(given.progress), RidgeConfig(**options)
    log_pi, _ = behaviour_cloning(
        given.model,
        given.demonstrations,
        given.problem.features,
        config=config,
        callback=count,
    )
    converged = count.done < config.max_iterations
    return Found(q=log_pi, iterations=count.done, converged=converged)


def goals(given: Inputs, **options: Any) -> Found:
    """Fit by `irl.posterior`; options as `GoalConfig`."""
    learner = GoalLearner(given.problem, rng=given.rng, config=GoalConfig(**options))
    learner.learn(given.demonstrations)
    if given.progress is not None:
        given.progress(learner.belief.goal.size, float(np.log(learner.belief.weight.max())))
    agree = learner.ends_agree >= AGREE
    note = "" if agree else "demonstrations end where no plan of its does: the goal is not found"
    return Found(
        learner.reward, learner.q, iterations=learner.belief.goal.size, converged=agree, note=note
    )
