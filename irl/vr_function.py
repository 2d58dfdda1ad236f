"""The VR function f(s, Θ) = R(s) + γ V*(s), thesis (3.15), as a small neural network.

One number per state carries reward and value together, so that likelihood (3.19) and action
values (3.17) follow from it by one sparse product and no planning.

Training evaluates the same states thousands of times. ``VRFunction.at`` therefore prepares an
evaluation once: activations lie in buffers ``[width + 1, n]`` whose last row is 1, so that a
layer, bias included, is one matrix product in each direction and nothing is allocated.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import torch

from irl.choices import check_choice
from irl.errors import InputError

DEVICES = ("cpu", "cuda")
WIDEST = 10_000  # of a layer that settings may ask for: two of them take 400 MB
CHUNK = 65_536  # states evaluated at a time by ``values``: bounds memory
ALIGNMENT = 16  # buffers hold a multiple of so many states: 64 bytes, a cache line


def torch_device(name: str) -> torch.device:
    """Where a network lives: ``cpu``, or ``cuda`` for large problems on a GPU.

    Raises:
        InputError: if the name is unknown, or this machine has no such device.
    """
    check_choice("device", name, DEVICES)
    if name == "cuda" and not torch.cuda.is_available():
        raise InputError("'cuda' is not available to PyTorch here", place="device", valid=["cpu"])
    return torch.device(name)


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
        device: str = "cpu",
    ) -> None:
        """Draw Θ₀ from ``generator``: uniform within ±1/√n_in, as PyTorch's linear layers.

        The default widths are those of thesis §6.3. Θ₀ is drawn on the CPU, so that one seed
        starts from the same weights on every device.

        Raises:
            InputError: if a width is below 1, or there is no such device.
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
        drawn = torch.zeros(len(columns) * sum(a * b for a, b in shapes))
        for layer in _views(drawn, shapes * len(columns)):
            bound = (layer.shape[1] - 1) ** -0.5
            layer.uniform_(-bound, bound, generator=generator)
        self.n_features = n_features
        self.parameters = drawn.to(torch_device(device))
        layers = _views(self.parameters, shapes * len(columns))
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
        f = [self.at(part).forward().cpu() for part in x.split(CHUNK)]
        return torch.cat(f).double().numpy()

    def arrays(self) -> dict[str, np.ndarray]:
        """Copy the weights out, as ``term.layer.weight`` ``[n_out, n_in]`` and ``….bias``."""
        arrays = {}
        for k, (_, layers) in enumerate(self.terms):
            for i, layer in enumerate(layers):
                arrays[f"{k}.{i}.weight"] = layer[:, :-1].cpu().numpy().copy()
                arrays[f"{k}.{i}.bias"] = layer[:, -1].cpu().numpy().copy()
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray], device: str = "cpu") -> "VRFunction":
        """Rebuild a network from what ``arrays()`` gave; widths are read off the shapes.

        A saved policy holds them: ``VRFunction.from_arrays(load_policy(path).weights)``.

        Raises:
            InputError: if a name is missing or unknown, shapes don't fit together, or there is
                no such device.
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
            device=device,
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


class _Layer(NamedTuple):
    """A layer at n states: its buffers, and the views of them that each evaluation needs.

    A view costs about as much to make as a small matrix product, so all are made once.

    Attributes:
        weights: ``[n_out, n_in + 1]``, the network's own.
        back: ``[n_in, n_out]``: the weights without the bias, transposed.
        gradient: ``[n_out, n_in + 1]``, of the weights.
        inputs: ``[n_in + 1, n]``, the last row 1.
        inputs_T: the same, transposed.
        activations: ``[n_in, n]``: ``inputs`` without the last row; the layer below fills it.
        slopes: ``[n_in, n]``: derivatives by what the layer below gave before its ReLU.
    """

    weights: torch.Tensor
    back: torch.Tensor
    gradient: torch.Tensor
    inputs: torch.Tensor
    inputs_T: torch.Tensor
    activations: torch.Tensor
    slopes: torch.Tensor

    @classmethod
    def at(cls, weights: torch.Tensor, gradient: torch.Tensor, n: int) -> "_Layer":
        """Allocate the buffers for n states."""
        inputs = torch.ones(weights.shape[1], n, device=weights.device)
        activations = inputs[:-1]
        slopes = torch.empty_like(activations)
        return cls(weights, weights[:, :-1].T, gradient, inputs, inputs.T, activations, slopes)


class Evaluation:
    """f and its gradient at fixed states, always with the network's present weights."""

    def __init__(self, network: VRFunction, features: torch.Tensor) -> None:
        """Allocate the buffers; ``features`` float32 ``[n, n_features]``."""
        n = len(features)
        # Rows that begin on a cache line make products faster. States that only fill up have
        # features 1 and df 0, and so no part in any result.
        size = -(-n // ALIGNMENT) * ALIGNMENT
        self._gradient = torch.zeros_like(network.parameters)
        self._f, self._df, self._top = self._gradient.new_zeros(3, 1, size)
        self._f_asked, self._df_asked = self._f[0, :n], self._df[0, :n]
        shapes = [
            (layer.shape[0], layer.shape[1]) for _, layers in network.terms for layer in layers
        ]
        gradients = iter(_views(self._gradient, shapes))
        self._terms = []
        for columns, weights in network.terms:
            layers = [_Layer.at(w, next(gradients), size) for w in weights]
            layers[0].activations[:, :n] = features[:, columns].T
            self._terms.append(layers)

    def forward(self) -> torch.Tensor:
        """F ``[n]``, a buffer that the next call overwrites."""
        for k, layers in enumerate(self._terms):
            for layer, above in pairwise(layers):
                torch.mm(layer.weights, layer.inputs, out=above.activations).relu_()
            # The first term overwrites, the others add.
            self._f.addmm_(layers[-1].weights, layers[-1].inputs, beta=min(k, 1))
        self._f.tanh_()
        return self._f_asked

    def backward(self, df: torch.Tensor) -> torch.Tensor:
        """Gradient in Θ of Σ df·f, given df ``[n]``; once after each ``forward``.

        Returns:
            float32 ``[n_parameters]``, a buffer that the next call overwrites.
        """
        self._df_asked.copy_(df)
        # tanh' = 1 − f²
        top = torch.mul(self._df, self._f, out=self._top)
        torch.addcmul(self._df, top, self._f, value=-1, out=top)
        for layers in self._terms:
            above = top
            for layer in layers[:0:-1]:
                torch.mm(above, layer.inputs_T, out=layer.gradient)
                torch.mm(layer.back, above, out=layer.slopes)
                # ReLU's slope is its output's sign, and the output has served by now.
                above = layer.slopes.mul_(layer.activations.sign_())
            torch.mm(above, layers[0].inputs_T, out=layers[0].gradient)
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
