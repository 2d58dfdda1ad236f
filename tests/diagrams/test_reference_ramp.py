import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from diagrams.reference_ramp import ReferenceRamp
from models.errors import ModelError


def run(seconds, command, start):
    ramp = ReferenceRamp(2, speed=0.5, period=0.01)
    simulator = Simulator(ramp)
    context = simulator.get_mutable_context()
    ramp.set_reference(context, np.array(start))
    ramp.get_input_port().FixValue(context, command)
    simulator.AdvanceTo(seconds)
    return ramp.get_output_port().Eval(context)


def test_moves_at_its_speed_and_tells_its_velocity():
    position, velocity = np.split(run(1.0, [2.0, -2.0], [0.0, 0.0]), 2)
    assert position == pytest.approx([0.5, -0.5], abs=0.011)
    assert velocity == pytest.approx([0.5, -0.5])


def test_arrives_and_rests_exactly_on_the_command():
    position, velocity = np.split(run(1.0, [0.3, 0.1], [0.2, 0.1]), 2)
    assert position == pytest.approx([0.3, 0.1], abs=1e-15)
    assert velocity == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    "options",
    [
        {"speed": 0.0, "period": 0.01},
        {"speed": np.nan, "period": 0.01},
        {"speed": [1.0, 2.0, 3.0], "period": 0.01},
        {"speed": 1.0, "period": 0.0},
        {"speed": 1.0, "period": np.nan},
    ],
)
def test_speed_and_period_are_above_zero(options):
    with pytest.raises(ModelError, match=r"speed|period"):
        ReferenceRamp(2, **options)


def test_each_step_goes_as_far_towards_the_command_as_the_speed_allows():
    speed, period = np.array([0.1, 1.5]), 0.002
    ramp = ReferenceRamp(2, speed=speed, period=period)
    simulator = Simulator(ramp)
    context = simulator.get_mutable_context()
    position = np.array([0.3, -1.0])
    ramp.set_reference(context, position)
    rng = np.random.default_rng(0)
    for n in range(100):
        if n % 20 == 0:
            command = position + rng.uniform(-0.003, 0.003, 2) * [1.0, 15.0]
            ramp.get_input_port().FixValue(context, command)
        simulator.AdvanceTo((n + 1) * period)
        step = np.clip(command - position, -speed * period, speed * period)
        position = position + step
        expected = np.concatenate([position, step / period])
        found = ramp.get_output_port().Eval(context)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
