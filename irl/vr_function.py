"""The VR function f(s, Θ) = R(s) + γ V*(s), thesis (3.15), as a small neural network.

One number per state carries reward and value together, so that likelihood (3.19) and action
values (3.17) follow from it by one sparse product and no planning.

Training evaluates the same states thousands of times. ``VRFunction.at`` therefore prepares an
evaluation once: activations lie in buffers ``[width + 1, n]`` whose last row is 1, so that a
layer, bias included, is one matrix product in each direction and nothing is allocated.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import torch

from irl.errors import InputError

CHUNK = 65_536  # states evaluated at a time by ``values``: bounds memory


def torch_generator(rng: np.random.Generator) -> torch.Generator:
    """A torch generator seeded by the next draw of ``rng``."""
    return torch.Generator().manual_seed(int(rng.integers(2**63)))


class VRFunction:
    """tanh(g(x)) in (−1, 1), g a perceptron with ReLU layers; float32.

    An *additive* one is tanh(Σ_k g_k(x_k)): one perceptron a feature, so that features cannot
    interact. Steadier where the value is separable, as on an empty grid; wrong elsewhere.

    Attributes:
        parameters: Θ, float32 ``[n_parameters]``; every weight is a view into it.
        terms: for each perceptron its feature columns and its layers ``[n_out, n_in + 1]``,
            the bias being the last column.
    """

    def __init__(
        self,
        n_features: int,
        hidden: Sequence[int] = (150, 50),
        *,
        generator: torch.Generator,
        additive: bool = False,
    ) -> None:
        """Draw Θ₀ from ``generator``: uniform within ±1/√n_in, as PyTorch's linear layers.

        The default widths are those of thesis §6.3.

        Raises:
            InputError: if a width is below 1.
        """
        if min((n_features, *hidden)) < 1:
            raise InputError(
                f"network: every width must be at least 1, got {[n_features, *hidden]}"
            )
        columns = (
            [slice(k, k + 1) for k in range(n_features)] if additive else [slice(0, n_features)]
        )
        widths = (columns[0].stop, *hidden, 1)
        shapes = [(n_out, n_in + 1) for n_in, n_out in pairwise(widths)]
        self.n_features = n_features
        self.parameters = torch.zeros(len(columns) * sum(a * b for a, b in shapes))
        layers = _views(self.parameters, shapes * len(columns))
        for layer in layers:
            bound = (layer.shape[1] - 1) ** -0.5
            layer.uniform_(-bound, bound, generator=generator)
        depth = len(shapes)
        self.terms = [
            (columns[k], layers[k * depth : (k + 1) * depth]) for k in range(len(columns))
        ]

    def at(self, features: np.ndarray | torch.Tensor) -> "Evaluation":
        """Prepare to evaluate f and its gradient at the rows of ``features`` ``[n, n_features]``.

        Raises:
            InputError: if the number of features is not the network's.
        """
        x = torch.as_tensor(features, dtype=torch.float32)
        if x.ndim != 2 or x.shape[1] != self.n_features:
            raise InputError(
                f"features: shape {tuple(x.shape)} given, [states, {self.n_features}] wanted"
            )
        return Evaluation(self, x)

    def values(self, features: np.ndarray | torch.Tensor) -> np.ndarray:
        """Evaluate f at every row of ``features`` ``[n, n_features]``: float64 ``[n]``.

        Raises:
            InputError: as ``at``.
        """
        x = torch.as_tensor(features, dtype=torch.float32)
        return torch.cat([self.at(part).forward() for part in x.split(CHUNK)]).double().numpy()

    def arrays(self) -> dict[str, np.ndarray]:
        """Copy the weights out, as ``term.layer.weight`` ``[n_out, n_in]`` and ``….bias``."""
        arrays = {}
        for k, (_, layers) in enumerate(self.terms):
            for i, layer in enumerate(layers):
                arrays[f"{k}.{i}.weight"] = layer[:, :-1].numpy().copy()
                arrays[f"{k}.{i}.bias"] = layer[:, -1].numpy().copy()
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "VRFunction":
        """Rebuild a network from what ``arrays()`` gave; widths are read off the shapes.

        Raises:
            InputError: if a name is missing or unknown, or shapes don't fit together.
        """
        weights = [np.shape(arrays[name]) for name in sorted(arrays) if name[-7:] == ".weight"]
        n_terms = len({name.split(".")[0] for name in arrays})
        if not weights or any(len(shape) != 2 for shape in weights):
            raise InputError("weights: matrices named '0.0.weight', '0.1.weight', … wanted")
        depth = len(weights) // n_terms
        network = cls(
            n_terms * weights[0][1] if n_terms > 1 else weights[0][1],
            [n_out for n_out, _ in weights[: depth - 1]],
            generator=torch.Generator(),
            additive=n_terms > 1,
        )
        wanted = network.arrays()
        if wanted.keys() != arrays.keys():
            raise InputError(f"weights: fields {sorted(arrays)} given, {sorted(wanted)} wanted")
        for name, array in wanted.items():
            if array.shape != np.shape(arrays[name]):
                raise InputError(
                    f"weights: field '{name}' has shape {np.shape(arrays[name])}, not {array.shape}"
                )
        for k, (_, layers) in enumerate(network.terms):
            for i, layer in enumerate(layers):
                layer[:, :-1] = torch.as_tensor(np.array(arrays[f"{k}.{i}.weight"]))
                layer[:, -1] = torch.as_tensor(np.array(arrays[f"{k}.{i}.bias"]))
        return network


class Evaluation:
    """f and its gradient at fixed states, always with the network's present weights."""

    def __init__(self, network: VRFunction, features: torch.Tensor) -> None:
        """Allocate the buffers; ``features`` float32 ``[n, n_features]``."""
        n = len(features)
        self._gradient = torch.zeros_like(network.parameters)
        self._score = torch.empty(1, n)
        self._f = torch.empty(1, n)
        shapes = [
            (layer.shape[0], layer.shape[1]) for _, layers in network.terms for layer in layers
        ]
        gradients = iter(_views(self._gradient, shapes))
        self._terms = []
        for columns, layers in network.terms:
            inputs = [torch.ones(layer.shape[1], n) for layer in layers]
            inputs[0][:-1] = features[:, columns].T
            slopes = [torch.empty(layer.shape[1] - 1, n) for layer in layers[1:]]
            self._terms.append((layers, [next(gradients) for _ in layers], inputs, slopes))

    def forward(self) -> torch.Tensor:
        """F ``[n]``, a buffer that the next call overwrites."""
        self._f.zero_()
        for layers, _, inputs, _ in self._terms:
            for layer, below, above in zip(layers, inputs, inputs[1:], strict=False):
                torch.mm(layer, below, out=above[:-1]).relu_()
            self._f += torch.mm(layers[-1], inputs[-1], out=self._score)
        return self._f.tanh_()[0]

    def backward(self, df: torch.Tensor) -> torch.Tensor:
        """Gradient in Θ of Σ df·f, given df ``[n]``; once after each ``forward``.

        Returns:
            float32 ``[n_parameters]``, a buffer that the next call overwrites.
        """
        f = self._f[0]
        top = (df.to(torch.float32) * (1 - f * f))[None]
        for layers, gradients, inputs, slopes in self._terms:
            torch.mm(top, inputs[-1].T, out=gradients[-1])
            above = top
            for i in range(len(layers) - 1, 0, -1):
                torch.mm(layers[i][:, :-1].T, above, out=slopes[i - 1])
                # ReLU's slope is its output's sign, and the output has served by now.
                above = slopes[i - 1].mul_(inputs[i][:-1].sign_())
                torch.mm(above, inputs[i - 1].T, out=gradients[i - 1])
        return self._gradient


def _views(flat: torch.Tensor, shapes: Sequence[tuple[int, int]]) -> list[torch.Tensor]:
    """Matrices of the given shapes, one after the other in ``flat``."""
    return [
        part.view(shape)
        for part, shape in zip(flat.split([a * b for a, b in shapes]), shapes, strict=True)
    ]


def pin(f: np.ndarray, fixed_vr: Mapping[int, float]) -> np.ndarray:
    """Copy f ``[n_states]``, with the states of ``fixed_vr`` held at their given values."""
    pinned = np.array(f, dtype=np.float64)
    pinned[list(fixed_vr)] = list(fixed_vr.values())
    return pinned
