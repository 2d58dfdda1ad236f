"""A simulated mind in a person's place: it shows first, and answers, to try a lesson out."""

import numpy as np

from experiments.teach.desk import Desk
from experiments.teach.worlds import World
from irl.collection import demonstrate_to_the_end
from irl.demonstrations import Demonstrations
from irl.lesson_events import DONE

SECONDS = 2.0
"""What an answer takes it."""


def demonstrated(world: World, count: int, rng: np.random.Generator) -> Demonstrations:
    """Trajectories of the oracle from starts drawn by chance, each to its end."""
    if not count:
        return Demonstrations.empty()
    starts = rng.choice(world.subject.problem.start_states, count)
    return demonstrate_to_the_end(world.oracle, starts, rng)


def would_say(world: World, state: int, proposed: int | None, rng: np.random.Generator) -> int:
    """The oracle's answer: what is proposed if that is as good as its own choice."""
    if world.oracle.terminal[state]:
        return DONE
    good = world.oracle.optimal_actions[state]
    if proposed is not None and proposed != DONE and good[proposed]:
        return proposed
    return world.oracle.label(state, rng)


def answer_as_the_oracle(desk: Desk, answers: int, rng: np.random.Generator) -> None:
    """Answer until the learner says that it is enough, or so many questions are answered."""
    for _ in range(answers):
        asked = desk.question
        if asked is None or (desk.enough.enough and not desk.enough.stands_in):
            break
        action = would_say(desk.world, asked.state, asked.proposed, rng)
        desk.answer(asked.token, action, seconds=SECONDS)
