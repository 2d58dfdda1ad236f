"""What was learnt of each state, drawn over the states' features, however many those are."""

import textwrap
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from scipy.sparse import identity
from scipy.sparse.linalg import spsolve

from irl.mdp import TransitionModel
from irl.planning import transition_matrix


def expected_visits(
    model: TransitionModel, action: np.ndarray, starts: np.ndarray, gamma: float
) -> np.ndarray:
    """Discounted visits of each state, Σ_t γᵗ P(s_t = s), float64 ``[n_states]``.

    Args:
        model: the transition model.
        action: the policy ``[n_states]``, −1 where a run ends.
        starts: states, each as likely to be the first.
        gamma: discount factor in [0, 1).
    """
    first = np.bincount(starts, minlength=model.n_states) / starts.size
    onward = identity(model.n_states) - gamma * transition_matrix(model, action).T
    return np.asarray(spsolve(onward.tocsc(), first))


def plane(features: np.ndarray, names: tuple[str, ...] = ()) -> tuple[np.ndarray, list[str]]:
    """Places of states in a plane, ``[n_states, 2]``, and what the two axes are called.

    Two features are the axes; a single one lies along the first. Of more, brought to unit
    variance, the two directions are taken in which states differ most.

    Args:
        features: ``[n_states, d]``, d ≥ 1, finite.
        names: one for each feature; numbered if absent.
    """
    n, d = features.shape
    labels = list(names) or [f"feature {k}" for k in range(d)]
    if d == 1:
        return np.hstack([features, np.zeros((n, 1))]), [labels[0], ""]
    if d == 2:
        return features, labels
    centred = features - features.mean(axis=0)
    spread = centred.std(axis=0)
    centred /= np.where(spread > 0, spread, 1.0)
    _, size, axes = np.linalg.svd(centred, full_matrices=False)
    share = size**2 / max(float((size**2).sum()), np.finfo(float).tiny)
    axes *= np.where(axes[:, np.abs(axes).argmax(axis=1)].diagonal() < 0, -1, 1)[:, None]
    return centred @ axes[:2].T, [f"component {k + 1} ({share[k]:.0%} of variance)" for k in (0, 1)]


def of_states(measure: np.ndarray, action: np.ndarray) -> np.ndarray:
    """A measure per state, ``[n_states]``: of one of pairs, such as a reward, what is done counts.

    Args:
        measure: ``[n_states]``, which stays as it is, or ``[n_states, n_actions]``.
        action: the policy ``[n_states]``, −1 where nothing is done, which gives NaN.
    """
    if measure.ndim == 1:
        return measure
    done = measure[np.arange(action.size), np.maximum(action, 0)]
    return np.where(action < 0, np.nan, done)


def plot_over_features(
    figure: Figure,
    features: np.ndarray,
    measures: Mapping[str, np.ndarray],
    sentence: str,
    names: tuple[str, ...] = (),
) -> None:
    """Draw a panel per measure, a coloured dot per state; states in one place share their mean.

    Args:
        figure: to draw on.
        features: ``[n_states, d]``, d ≥ 1, finite.
        measures: title with unit → a number per state ``[n_states]``, NaN where there is none.
        sentence: what the picture says, above it.
        names: one for each feature; numbered if absent.
    """
    width = 4.2 * len(measures)
    figure.set_size_inches(width, 4.2)
    places, labels = plane(features, names)
    where, of_state = np.unique(places.round(9), axis=0, return_inverse=True)
    of_state = of_state.ravel()
    size = float(np.clip(9000 / len(where), 4, 160))
    axes = figure.subplots(1, len(measures), sharex=True, sharey=True, squeeze=False)[0]
    for axis, (title, values) in zip(axes, measures.items(), strict=True):
        known = np.isfinite(values)
        count = np.bincount(of_state[known], minlength=len(where))
        total = np.bincount(of_state[known], values[known], minlength=len(where))
        some = count > 0
        axis.scatter(*where[~some].T, s=size, facecolors="none", edgecolors="0.7")
        dots = axis.scatter(
            *where[some].T, c=total[some] / count[some], s=size, cmap="viridis", edgecolors="none"
        )
        figure.colorbar(dots, ax=axis, location="bottom", shrink=0.9)
        axis.set_title(title, fontsize=10)
        axis.set_xlabel(labels[0], fontsize=9)
        if not labels[1]:
            axis.set_yticks([])
    axes[0].set_ylabel(labels[1], fontsize=9)
    figure.suptitle(textwrap.fill(sentence, int(11 * width)), fontsize=10)
