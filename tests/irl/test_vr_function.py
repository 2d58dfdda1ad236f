import numpy as np
import pytest
import torch

from irl.errors import InputError
from irl.vr_function import VRFunction, pin


def network(seed=0, n_features=3, hidden=(7, 5), **options):
    return VRFunction(n_features, hidden, generator=torch.Generator().manual_seed(seed), **options)


def by_autograd(net, x):
    """f through plain torch operations, differentiable in a copy of the parameters."""
    flat = net.parameters.clone().requires_grad_()
    offset, score = 0, 0
    for columns, layers in net.terms:
        h = x[:, columns]
        for i, layer in enumerate(layers):
            part = flat[offset : offset + layer.numel()].view(layer.shape)
            offset += layer.numel()
            h = torch.nn.functional.linear(h, part[:, :-1], part[:, -1])
            h = torch.relu(h) if i < len(layers) - 1 else h
        score = score + h[:, 0]
    return torch.tanh(score), flat


@pytest.mark.parametrize("additive", [False, True])
@pytest.mark.parametrize("hidden", [(150, 50), (7, 5, 3), (4,), ()])
@pytest.mark.parametrize("n", [1, 20, 32])
def test_value_and_gradient_are_those_of_autograd(additive, hidden, n):
    net = network(hidden=hidden, additive=additive)
    x = torch.rand(n, 3, generator=torch.Generator().manual_seed(1))
    df = torch.rand(n, generator=torch.Generator().manual_seed(2))
    f, flat = by_autograd(net, x)
    (f * df).sum().backward()
    at = net.at(x)
    torch.testing.assert_close(at.forward(), f.detach(), rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(at.backward(df), flat.grad, rtol=1e-5, atol=1e-6)
    # Buffers are used again: a second round must not remember the first.
    at.forward()
    torch.testing.assert_close(at.backward(df), flat.grad, rtol=1e-5, atol=1e-6)


def test_an_absent_or_unknown_device_is_refused():
    with pytest.raises(InputError, match=r"device.*cpu, cuda"):
        network(device="tpu")
    if not torch.cuda.is_available():
        with pytest.raises(InputError, match=r"'cuda' is not available.*valid: cpu"):
            network(device="cuda")
        with pytest.raises(InputError, match="'cuda' is not available"):
            VRFunction.from_arrays(network().arrays(), device="cuda")
    assert torch.equal(network(device="cpu").parameters, network().parameters)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_a_gpu_gives_the_same_values_and_gradients():
    here, there = network(), network(device="cuda")
    x = torch.rand(20, 3, generator=torch.Generator().manual_seed(1))
    df = torch.rand(20, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    results = []
    for net in (here, there):
        at = net.at(x)
        results.append((at.forward().cpu().clone(), at.backward(df).cpu()))
    for ours, theirs in zip(*results, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(here.values(x), there.values(x), rtol=1e-4, atol=1e-5)
    again = VRFunction.from_arrays(there.arrays())
    assert torch.equal(again.parameters, there.parameters.cpu())


def test_initial_weights_have_pytorchs_distribution():
    net = network(n_features=400, hidden=(300,))
    first, second = net.terms[0][1]
    for layer, n_in in ((first, 400), (second, 300)):
        bound = n_in**-0.5
        assert layer.abs().max() <= bound
    # Uniform within ±b: standard deviation b / √3.
    assert first.std().item() == pytest.approx(400**-0.5 / 3**0.5, rel=0.02)


def test_initialisation_neither_uses_nor_disturbs_global_randomness():
    before = torch.random.get_rng_state()
    a, b, c = network(0), network(0), network(1)
    assert torch.equal(before, torch.random.get_rng_state())
    assert torch.equal(a.parameters, b.parameters)
    assert not torch.equal(a.parameters, c.parameters)


def test_values_in_chunks_equal_values_at_once(monkeypatch):
    net = network()
    x = np.random.default_rng(0).random((25, 3))
    whole = net.values(x)
    monkeypatch.setattr("irl.vr_function.CHUNK", 10)
    np.testing.assert_allclose(net.values(x), whole, rtol=1e-6)
    assert whole.dtype == np.float64
    assert (np.abs(whole) < 1).all()


@pytest.mark.parametrize("additive", [False, True])
def test_weights_survive_arrays(additive):
    net = network(additive=additive)
    again = VRFunction.from_arrays(net.arrays())
    assert torch.equal(net.parameters, again.parameters)
    assert len(again.terms) == len(net.terms)


def test_bad_weights_and_features_are_named():
    arrays = network().arrays()
    with pytest.raises(InputError, match=r"0\.0\.weight"):
        VRFunction.from_arrays({})
    with pytest.raises(InputError, match=r"0\.1\.bias"):
        VRFunction.from_arrays(arrays | {"0.1.bias": np.zeros(3)})
    with pytest.raises(InputError, match="fields"):
        VRFunction.from_arrays({k: v for k, v in arrays.items() if k != "0.2.bias"})
    with pytest.raises(InputError, match="features"):
        network().values(np.zeros((4, 2)))
    with pytest.raises(InputError, match="width"):
        network(hidden=(5, 0))


def test_pin_copies():
    f = np.zeros(3)
    assert pin(f, {1: -1.0}).tolist() == [0, -1, 0]
    assert f.tolist() == [0, 0, 0]
    assert pin(f, {}).tolist() == [0, 0, 0]
