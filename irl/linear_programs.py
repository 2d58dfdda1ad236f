"""The linear programs as methods, and what there is to know of what they found.

(3.7) and (3.12) promise margins of the demonstrated actions over others. Whether there are any is
counted under the reward's own optimal values, in which unlabelled states are planned for.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from irl.advice import Advice
from irl.baselines.linear_programming import largest_l1, lp, margins
from irl.baselines.lp_advice import TrustConfig, lp_advice
from irl.baselines.lp_basis import lp_basis
from irl.baselines.lp_bumps import ENOUGH, lp_bumps
from irl.choices import check_number
from irl.mdp import TransitionModel
from irl.method_inputs import Count, Found, Inputs, labelled_policy, walk_ends, walks
from irl.planning import value_iteration

SLACK = 0.05
"""Share of the optimum of (3.9) and (3.12) that is given up for the smallest margin. The sum of
margins is often largest where some are 0 or below, and then, be it in the first state of every run,
an action that leads nowhere is as good as the one demonstrated or better."""


def largest_margins(given: Inputs, slack: float = 0.01, l1: float = 1.0, **options: Any) -> Found:
    """Fit by (3.7); options as `lp`."""
    model, gamma = given.model, given.gamma
    policy = labelled_policy(model, given.demonstrations)
    reward = lp(model, policy, gamma, slack=slack, l1=l1, **options)
    if reward.any():
        return replace(_with_margins(given, policy, reward), converged=True)
    most = largest_l1(model, policy, gamma)
    if most == 0:
        return Found(reward, converged=True, note=_no_margin(model, policy))
    lower = {"l1": most / 2}
    note = f"no preference: R = 0 is best at l1 = {l1:g}; lower l1 below {most:.4g}"
    return Found(reward, converged=True, note=note, lower=lower)


def with_advice(given: Inputs, slack: float = SLACK, **options: Any) -> Found:
    """Fit by (3.9); options as `TrustConfig`."""
    advice = given.advice or Advice.none(given.model.n_states, given.model.n_actions)
    config, count = TrustConfig(slack=slack, **options), Count(given.progress)
    reward = lp_advice(
        given.model,
        given.demonstrations,
        advice,
        gamma=given.gamma,
        config=config,
        callback=count,
    )
    learnt = Found(reward)
    if reward.any() and len(given.demonstrations):
        learnt = _with_margins(given, labelled_policy(given.model, given.demonstrations), reward)
    return replace(learnt, iterations=count.done, converged=count.done < config.rounds)


def over_basis(
    given: Inputs,
    basis: np.ndarray | None = None,
    bumps: int = 256,
    slack: float = SLACK,
    **options: Any,
) -> Found:
    """Fit by (3.12); ``bumps`` is the largest number of them, other options as `lp_basis`.

    Bumps are chosen by how well they explain, and do without ``slack``.
    """
    check_number("bumps", bumps, whole=True)
    model, gamma, shown = given.model, given.gamma, given.demonstrations
    policy = labelled_policy(model, shown)
    q, converged, count = None, True, Count(given.progress)
    if basis is None and model.n_states > bumps and not options:
        ends, features = walk_ends(model, walks(shown)), given.problem.required_features()
        found = lp_bumps(
            model, shown, policy, ends, features, gamma=gamma, most=bumps, callback=count
        )
        reward, q, converged = found.reward, found.q, found.explained >= ENOUGH
    else:
        reward, _ = lp_basis(model, policy, basis, gamma=gamma, slack=slack, **options)
    if reward.any():
        learnt = _with_margins(given, policy, reward, q)
    else:
        learnt = Found(reward, note=_no_margin(model, policy))
    return replace(learnt, iterations=count.done or None, converged=converged)


def _with_margins(
    given: Inputs, policy: np.ndarray, reward: np.ndarray, q: np.ndarray | None = None
) -> Found:
    """A reward, and in how many states it does not single out the action demonstrated."""
    if q is None:
        _, q = value_iteration(given.model, reward, given.gamma)
    margin = margins(given.model, q, policy)
    tolerance = 1e-7 * np.abs(q[np.isfinite(q)]).max()
    told = [
        f"in {count} another action is {words}"
        for count, words in (
            ((margin < -tolerance).sum(), "better"),
            ((np.abs(margin) <= tolerance).sum(), "as good"),
        )
        if count
    ]
    note = f"margins not met: of {margin.size} demonstrated states, {', '.join(told)}"
    return Found(reward, q, note=note if told else "")


def _no_margin(model: TransitionModel, policy: np.ndarray) -> str:
    if (model.widths[policy >= 0] > 1).any():
        return "no preference: R = 0; no reward puts the demonstrated actions above the others"
    return "no preference: R = 0; no demonstrated state offers a choice of actions"
