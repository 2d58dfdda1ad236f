"""Gradient ascent on one flat vector: the plain step of thesis (3.14), and Adam."""

import torch


class GradientAscent:
    """Θ ← Θ + α ∇L − α·decay·Θ."""

    def __init__(self, parameters: torch.Tensor, weight_decay: float = 0.0) -> None:
        """Ascend ``parameters`` ``[n]``, in place."""
        self._parameters = parameters
        self._weight_decay = weight_decay

    def step(self, gradient: torch.Tensor, size: float) -> None:
        """Take one step of the given size along ``gradient`` ``[n]``."""
        self._parameters.mul_(1 - size * self._weight_decay).add_(gradient, alpha=size)


class Adam:
    """Adam (Kingma & Ba 2015) with decoupled weight decay, PyTorch's default constants."""

    BETA1, BETA2, EPSILON = 0.9, 0.999, 1e-8

    def __init__(self, parameters: torch.Tensor, weight_decay: float = 0.0) -> None:
        """Ascend ``parameters`` ``[n]``, in place."""
        self._parameters = parameters
        self._weight_decay = weight_decay
        self._mean = torch.zeros_like(parameters)
        self._square = torch.zeros_like(parameters)
        self._steps = 0

    def step(self, gradient: torch.Tensor, size: float) -> None:
        """Take one step of the given size along ``gradient`` ``[n]``."""
        self._steps += 1
        unbias1 = 1 - self.BETA1**self._steps
        unbias2 = 1 - self.BETA2**self._steps
        self._mean.lerp_(gradient, 1 - self.BETA1)
        self._square.mul_(self.BETA2).addcmul_(gradient, gradient, value=1 - self.BETA2)
        scale = self._square.sqrt().mul_(unbias2**-0.5).add_(self.EPSILON)
        if self._weight_decay:
            self._parameters.mul_(1 - size * self._weight_decay)
        self._parameters.addcdiv_(self._mean, scale, value=size / unbias1)


OPTIMIZERS: dict[str, type[Adam] | type[GradientAscent]] = {"adam": Adam, "sgd": GradientAscent}
