import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from diagrams.faults import SimulatorFault, first_line, simulating


class Ours(LeafSystem):
    """A system of ours with a mistake in it."""

    def __init__(self, error):
        super().__init__()

        def update(context, values):
            raise error

        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, update)


def test_what_drake_raises_is_a_fault_with_its_message_and_traceback():
    source = ConstantVectorSource([1.0])
    with pytest.raises(SimulatorFault, match="none") as caught, simulating():
        source.GetInputPort("none")
    text = caught.value.text
    assert first_line(text) == str(caught.value).splitlines()[0]
    assert "Traceback" in text and __file__ in text


def test_a_failed_assertion_of_drake_is_a_fault_too():
    simulator = Simulator(ConstantVectorSource([1.0]))
    with pytest.raises(SimulatorFault, match=r"^Failure at"), simulating():
        simulator.AdvanceTo(-1.0)


@pytest.mark.parametrize(
    "error", [ValueError("ours"), KeyError("ours"), IndexError("ours"), NotImplementedError("ours")]
)
def test_an_error_of_ours_passes_as_it_is_even_through_drake(error):
    with pytest.raises(type(error), match="ours"), simulating():
        Simulator(Ours(error)).AdvanceTo(1.0)


@pytest.mark.parametrize("stop", [SystemExit(2), SystemExit("stop"), KeyboardInterrupt()])
def test_an_end_that_someone_asked_for_is_not_a_fault(stop):
    with pytest.raises(type(stop)), simulating():
        raise stop
