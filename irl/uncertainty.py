"""How unsure action values leave us of the action, alone and as a committee."""

import numpy as np


def action_probabilities(q: np.ndarray, beta: float) -> np.ndarray:
    """P_s(a) ∝ exp(β Q(s, a)), thesis (4.2), over finite entries; rows of −∞ give zeros.

    Shapes: ``[..., n_actions]`` both ways.
    """
    z = beta * q
    peak = z.max(axis=-1, keepdims=True)
    e = np.exp(z - np.where(np.isfinite(peak), peak, 0.0))
    return e / np.maximum(e.sum(axis=-1, keepdims=True), np.finfo(float).tiny)


def shannon_entropy(p: np.ndarray) -> np.ndarray:
    """−Σ p log p in nats, over the last axis: ``[..., n]`` to ``[...]``."""
    return -(p * np.log(np.where(p > 0, p, 1.0))).sum(axis=-1) + 0.0


def entropy(q: np.ndarray, beta: float = 1.0) -> np.ndarray:
    """E(s), thesis (4.1), in nats: ``[...]``, from 0 to the log of the finite entries."""
    return shannon_entropy(action_probabilities(q, beta))


def mutual_information(p: np.ndarray) -> np.ndarray:
    """What the action would tell about which member is right, in nats: BALD's score.

    The entropy of the members' mean, less the mean of their entropies (Houlsby et al. 2011,
    "Bayesian active learning for classification and preference learning"). Noise that all
    members agree on cancels; what is left can be learnt.

    Args:
        p: action probabilities ``[n_members, ..., n_actions]``.

    Returns:
        ``[...]``, from 0 where all agree to the entropy of the mean, and at most the log of the
        number of members.
    """
    within = np.mean([shannon_entropy(member) for member in p], axis=0)
    return np.maximum(shannon_entropy(p.mean(axis=0)) - within, 0.0)


def vote_entropy(q: np.ndarray) -> np.ndarray:
    """Entropy of the members' votes for their best action, in nats (Dagan & Engelson 1995).

    Args:
        q: action values ``[n_members, n_states, n_actions]``; where a member's are all −∞, all
            are, and they vote alike.

    Returns:
        ``[n_states]``, from 0 for one mind to the log of the number of members.
    """
    ballots = q.argmax(axis=-1)[..., None] == np.arange(q.shape[-1])
    return shannon_entropy(ballots.mean(axis=0))


def value_of_information(p: np.ndarray, q: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Expected gain from one answer in the value of the decisions taken after it.

    Howard (1966), "Information value theory": the value of the best decisions with the answer,
    averaged over answers, less that of the best decisions without it. Belief is a committee of
    equal members, and an answer a about state s re-weights them by Bayes' rule with the
    likelihood (4.2), member k to P_k(a | s) / Σ_j P_j(a | s). A decision is an action b in a
    state t, worth the belief's mean of Q_k(t, b). With n members

        V(s) = Σ_t w_t [ Σ_a max_b Σ_k P_k(a | s) Q_k(t, b) / n − max_b Σ_k Q_k(t, b) / n ],

    never negative, max being convex, and 0 where the members agree on the answer or where no
    answer changes a decision. The gain at s from knowing its own label is counted only as far
    as the members expect it, as is what training on the label would do beyond the committee.

    Args:
        p: answer probabilities ``[n_members, n_candidates, n_actions]``; rows sum to 1.
        q: action values ``[n_members, n_states, n_actions]`` where decisions count; −∞ where an
            action is excluded, for all members alike, and not in whole rows.
        weight: ``[n_states]``, how much each decision counts, such as visits in an episode.

    Returns:
        ``[n_candidates]``, in units of q times weight; the cost is the product of all sizes.
    """
    n_members, n_states, n_actions = q.shape
    excluded = np.isneginf(q[0])
    flat = np.where(excluded, 0.0, q).reshape(n_members, -1)

    def best(belief: np.ndarray) -> np.ndarray:
        """Σ_t w_t max_b of the values under weights ``[n, n_members]``: ``[n]``."""
        values = (belief @ flat).reshape(-1, n_states, n_actions)
        values[:, excluded] = -np.inf
        return values.max(axis=2) @ weight

    without = best(np.full((1, n_members), 1.0 / n_members))[0]
    gains = np.empty(p.shape[1])
    for c in range(gains.size):
        possible = p[:, c].sum(axis=0) > 0
        gains[c] = best(p[:, c, possible].T / n_members).sum() - without
    return np.maximum(gains, 0.0)
