import pytest
import torch

from irl.optimizers import OPTIMIZERS


@pytest.mark.parametrize(
    ("name", "theirs"), [("adam", torch.optim.AdamW), ("sgd", torch.optim.SGD)]
)
@pytest.mark.parametrize("decay", [0.0, 0.1])
def test_steps_are_those_of_torch(name, theirs, decay):
    generator = torch.Generator().manual_seed(0)
    ours = torch.randn(6, generator=generator, dtype=torch.float64)
    other = ours.clone().requires_grad_()
    optimizer = OPTIMIZERS[name](ours, decay)
    reference = theirs([other], lr=0.01, weight_decay=decay, maximize=False)
    for _ in range(20):
        gradient = torch.randn(6, generator=generator, dtype=torch.float64)
        other.grad = -gradient
        optimizer.step(gradient, 0.01)
        reference.step()
    torch.testing.assert_close(ours, other.detach(), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("name", OPTIMIZERS)
def test_moments_and_steps_are_all_it_remembers(name):
    generator = torch.Generator().manual_seed(0)
    gradients = torch.randn(10, 4, generator=generator)
    ours = torch.randn(4, generator=generator)
    optimizer = OPTIMIZERS[name](ours)
    for gradient in gradients[:5]:
        optimizer.step(gradient, 0.01)
    other = ours.clone()
    follower = OPTIMIZERS[name](other)
    follower.moments.copy_(optimizer.moments)
    follower.steps = optimizer.steps
    for gradient in gradients[5:]:
        optimizer.step(gradient, 0.01)
        follower.step(gradient, 0.01)
    assert torch.equal(ours, other)
