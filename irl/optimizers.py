"""Gradient ascent on one flat vector: the plain step of thesis (3.14), and Adam."""

import torch


class GradientAscent:
    """Θ ← Θ + α ∇L − α·decay·Θ.

    Attributes:
        moments: what it remembers of past gradients, ``[k, n]``; nothing, so k = 0.
        steps: steps taken.
    """

    def __init__(self, parameters: torch.Tensor, weight_decay: float = 0.0) -> None:
        """Ascend ``parameters`` ``[n]``, in place."""
        self._parameters = parameters
        self._weight_decay = weight_decay
        self.moments = parameters.new_zeros(0, parameters.numel())
        self.steps = 0

    def step(self, gradient: torch.Tensor, size: float) -> None:
        """Take one step of the given size along ``gradient`` ``[n]``."""
        self.steps += 1
        self._parameters.mul_(1 - size * self._weight_decay).add_(gradient, alpha=size)


class Adam:
    """Adam (Kingma & Ba 2015) with decoupled weight decay, PyTorch's default constants.

    Attributes:
        moments: running means of the gradients and of their squares, ``[2, n]``.
        steps: steps taken.
    """

    BETA1, BETA2, EPSILON = 0.9, 0.999, 1e-8

    def __init__(self, parameters: torch.Tensor, weight_decay: float = 0.0) -> None:
        """Ascend ``parameters`` ``[n]``, in place."""
        self._parameters = parameters
        self._weight_decay = weight_decay
        self._scale = torch.empty_like(parameters)
        self.moments = parameters.new_zeros(2, parameters.numel())
        self._mean, self._square = self.moments
        self.steps = 0

    def step(self, gradient: torch.Tensor, size: float) -> None:
        """Take one step of the given size along ``gradient`` ``[n]``."""
        self.steps += 1
        unbias1 = 1 - self.BETA1**self.steps
        unbias2 = (1 - self.BETA2**self.steps) ** 0.5
        self._mean.lerp_(gradient, 1 - self.BETA1)
        self._square.mul_(self.BETA2).addcmul_(gradient, gradient, value=1 - self.BETA2)
        # m / unbias1 / (√v / unbias2 + ε), with both corrections moved out of the vectors.
        scale = torch.sqrt(self._square, out=self._scale).add_(self.EPSILON * unbias2)
        if self._weight_decay:
            self._parameters.mul_(1 - size * self._weight_decay)
        self._parameters.addcdiv_(self._mean, scale, value=size * unbias2 / unbias1)


OPTIMIZERS: dict[str, type[Adam] | type[GradientAscent]] = {"adam": Adam, "sgd": GradientAscent}
