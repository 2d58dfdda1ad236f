"""The linear programs as methods, and what there is to know of what they found.

(3.7) and (3.12) promise margins of the demonstrated actions over others. Whether there are any is
counted under the reward's own optimal values, in which unlabelled states are planned for.

They value a policy, which needs an action in every state, and demonstrations tell some. Where none
was demonstrated, a guess comes first, and where planning for the reward found does not act as was
demonstrated, the best actions under it are next. (3.7) begins with the guess that a run ends there:
its price keeps rewards out of states that explain nothing. (3.12) has no such price, and so may
leave the largest reward in a state that a run is taken to end in, for planning to earn again and
again; it begins with even choices.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from irl.advice import Advice
from irl.baselines.linear_programming import largest_l1, lp, margins
from irl.baselines.lp_advice import TrustConfig, lp_advice
from irl.baselines.lp_basis import lp_basis
from irl.baselines.lp_bumps import ENOUGH, explained, lp_bumps
from irl.choices import check_number
from irl.mdp import TransitionModel
from irl.method_inputs import Count, Found, Inputs, labelled_policy, walk_ends, walks
from irl.planning import uniform_policy, value_iteration

SLACK = 0.05
"""Share of the optimum of (3.9) and (3.12) that is given up for the smallest margin. The sum of
margins is often largest where some are 0 or below, and then, be it in the first state of every run,
an action that leads nowhere is as good as the one demonstrated or better."""
_ROUNDS = 3  # programs, each with the best actions of the last one's reward elsewhere


def largest_margins(given: Inputs, slack: float = 0.01, l1: float = 1.0, **options: Any) -> Found:
    """Fit by (3.7); options as `lp`."""
    model, gamma = given.model, given.gamma
    policy = labelled_policy(model, given.demonstrations)

    def program(elsewhere: np.ndarray | None) -> np.ndarray:
        return lp(model, policy, gamma, slack=slack, l1=l1, elsewhere=elsewhere, **options)

    count = Count(given.progress)
    reward, q = _best_elsewhere(given, policy, program, None, count)
    if reward.any():
        learnt = _with_margins(given, policy, reward, q)
        return replace(learnt, iterations=count.done, converged=True)
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

        def program(elsewhere: np.ndarray | None) -> np.ndarray:
            more = {"elsewhere": elsewhere} | options
            return lp_basis(model, policy, basis, gamma=gamma, slack=slack, **more)[0]

        reward, q = _best_elsewhere(given, policy, program, uniform_policy(model.mask), count)
    if reward.any():
        learnt = _with_margins(given, policy, reward, q)
    else:
        learnt = Found(reward, note=_no_margin(model, policy))
    return replace(learnt, iterations=count.done or None, converged=converged)


def _best_elsewhere(
    given: Inputs,
    policy: np.ndarray,
    program: Callable[[np.ndarray | None], np.ndarray],
    elsewhere: np.ndarray | None,
    count: Count,
) -> tuple[np.ndarray, np.ndarray]:
    """Of a few programs, the reward that explains most of what was demonstrated, and its Q.

    Args:
        given: what the method is given.
        policy: the actions demonstrated, −1 where none was.
        program: from what is done elsewhere to a reward.
        elsewhere: the first guess.
        count: told of each program, and of how much the best so far explains.
    """
    model, open_to = given.model, (policy < 0) & (given.model.widths > 1)
    best, told = (np.zeros(model.n_states), np.zeros(model.mask.shape)), -np.inf
    for done in range(1, _ROUNDS + 1):
        reward = program(elsewhere)
        _, q = value_iteration(model, reward, given.gamma)
        now = explained(model, q, given.demonstrations)
        better = now > told
        if better:
            best, told = (reward, q), now
        count(done, told)
        if not better or not reward.any() or now >= 1 or not open_to.any():
            break
        elsewhere = np.eye(model.n_actions)[q.argmax(axis=1)]
    return best


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
