"""What goes otherwise than usual in an episode: pushed, pulled, heavier, seen badly, late, crooked.

A `Scenario` is typed YAML, read by Drake's own loader; those in ``shipped`` go by their names.
`draw` gives its sizes for one episode, and a `DisturbedStation` has the ports of the station, with
the disturbances between them and the plant. Nothing is moved but by forces.
"""

from diagrams.scenarios.disturbed_station import Disturbance, DisturbedStation
from diagrams.scenarios.draws import Draws, draw
from diagrams.scenarios.schema import Scenario, load_scenario, shipped_scenarios

__all__ = [
    "Disturbance",
    "DisturbedStation",
    "Draws",
    "Scenario",
    "draw",
    "load_scenario",
    "shipped_scenarios",
]
