"""An episode in which nothing moves, for tests of what shows episodes."""

import numpy as np

from diagrams.decisions import By, Step
from diagrams.monitor import Loads
from diagrams.policy_controller import Episode, Verdict
from diagrams.policy_run import Played
from diagrams.station import Station
from models.task.spaces import POSITIONS, Action, Kind, State

FAR, NEAR = State(14, 0), State(4, 0)
GRASP = Action(Kind.GRASP, 10).index
NOTHING = Loads(*[np.zeros(7)] * 4, 0)


def still(state, seconds=2.0, **options):
    """An episode in which nothing moves."""
    plant = Station().plant
    positions = plant.GetPositions(plant.CreateDefaultContext())
    positions[-7:] = [1.0, 0.0, 0.0, 0.0, *POSITIONS[state.position][:2], 0.52]
    frames = np.tile(positions, (round(24 * seconds), 1))
    step = Step(state.index, GRASP, State(state.position, 0, 10).index, 0.5, 1.5, "", By.FORECAST)
    episode = Episode((step,), Verdict.LOST)
    return Played(state.index, episode, seconds, frames[:1], NOTHING, frames=frames, **options)
