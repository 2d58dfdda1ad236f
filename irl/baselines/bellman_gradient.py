"""Bellman Gradient Iteration, Li, Sui & Burdick (2017, arXiv:1707.07767); BGI in Table 6.1.

The maximum in Bellman's equation is replaced by one that can be differentiated, and with it the
likelihood (3.13) of the demonstrations under π(a | s) ∝ exp(β Q(s, a)):

- ``norm``, the p-norm (Σ Qᵏ)^(1/k), for values from 0. The reward is shifted by its least entry
  first, which changes no choice where nothing ends; γ n^(1/k) must be below 1.
- ``soft``, the generalised soft maximum log Σ exp(k Q) / k.

The ascent is that of ``irl.baselines.linear_mlirl``, told which maximum to plan by:

    reward, weights = linear_mlirl(model, shown, gamma=0.9, config=BellmanGradientConfig())

The published method iterates ∂Q/∂θ = P (∂R/∂θ + γ ∂V/∂θ), a number for each pair and parameter.
The gradient of one likelihood needs only the transposed iteration, a number for each state, and
that is what runs here: the same fixed point, at a cost that does not grow with the parameters.
"""

from dataclasses import dataclass

from irl.baselines.differentiable_planning import Maximum, PNorm, SoftMax
from irl.baselines.linear_mlirl import MlirlConfig
from irl.choices import check_choice, check_range

SMOOTHINGS = ("soft", "norm")
SHARPNESS = 100.0  # k, unless told otherwise


@dataclass(frozen=True)
class BellmanGradientConfig(MlirlConfig):
    """How to smooth Bellman's equation, and to climb the likelihood."""

    smoothing: str = "soft"
    """soft or norm."""
    sharpness: float = SHARPNESS
    """k, in either."""

    def __post_init__(self) -> None:
        """Refuse values outside their limits, and unknown names."""
        super().__post_init__()
        smooth_maximum(self.smoothing, self.sharpness)

    @property
    def maximum(self) -> Maximum:
        """What stands in for the maximum."""
        return smooth_maximum(self.smoothing, self.sharpness)


def smooth_maximum(smoothing: str, sharpness: float) -> Maximum:
    """The maximum of that name and sharpness k.

    Raises:
        InputError: if the name is unknown, or k is out of range.
    """
    check_choice("smoothing", smoothing, SMOOTHINGS)
    check_range("sharpness", sharpness, 0.0, 1e9, open_low=True)
    return PNorm(sharpness) if smoothing == "norm" else SoftMax(1 / sharpness)
