"""Caution: a way that is sure, and one a little shorter on average that is not."""

import numpy as np
import pytest

from irl.caution import learn_caution
from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel
from irl.methods import learn
from irl.policy import Policy

GAMBLE, SURE, START, ON_THE_WAY, GOAL = 0, 1, 0, 1, 2
GAMMA = 0.9
PAYS = np.array([0.0, 0.0, 4.0])


@pytest.fixture
def fork() -> TransitionModel:
    """From the start a gamble gets to the goal, or stays; the sure way takes two actions."""
    entries = [(START, GAMBLE, GOAL, 0.5), (START, GAMBLE, START, 0.5)]
    entries += [(START, SURE, ON_THE_WAY, 1.0), (ON_THE_WAY, SURE, GOAL, 1.0)]
    return TransitionModel.from_entries(3, 2, *map(np.array, zip(*entries, strict=True)))


def shown(action: int, times: int) -> Demonstrations:
    way = [(START, action)] if action == GAMBLE else [(START, SURE), (ON_THE_WAY, SURE)]
    runs = [Demonstrations.from_pairs(way, k, end=GOAL) for k in range(times)]
    return Demonstrations.concatenate(runs)


def by_hand(action: int, times: int) -> float:
    """The mean of u where the goal is worth 1, by Bayes' rule, one hypothesis after the other."""
    sizes = [0.0, *(0.01 * 2 ** (k / 2) for k in range(13))]
    weights = []
    for u in sizes:
        sure = gamble = GAMMA
        for _ in range(200):
            gamble = 0.5 + 0.5 * GAMMA * max(sure, gamble) - u / 2
        total = 0.0
        for beta in (3, 10, 30, 100, 300, 1000):
            odds = np.exp(beta * ((gamble if action == GAMBLE else sure) - max(sure, gamble)))
            both = sum(np.exp(beta * (q - max(sure, gamble))) for q in (sure, gamble))
            for slip in (0.003, 0.03, 0.1, 0.2, 0.35, 0.5):
                total += ((1 - slip) * odds / both + slip / 2) ** times
        weights.append(total * (0.5 if u == 0 else 0.5 / 13))
    return float(np.dot(weights, sizes) / sum(weights))


@pytest.mark.parametrize(("action", "times"), [(SURE, 1), (SURE, 8), (GAMBLE, 1), (GAMBLE, 8)])
def test_it_is_the_mean_of_a_posterior(fork, action, times):
    said = shown(action, times)
    assert learn_caution(fork, said, PAYS, GAMMA) == pytest.approx(4 * by_hand(action, times))


def test_who_was_seen_to_gamble_is_taken_at_their_word(fork):
    seen = {a: learn_caution(fork, shown(a, 8), PAYS, GAMMA) for a in (GAMBLE, SURE)}
    assert seen[GAMBLE] < 0.1 * seen[SURE]


def test_planning_is_as_sure_as_it_was_shown_to_be():
    """One way or the other, or by chance either: what pays cannot tell these three apart."""
    one, other, goal, dead_end, either = 1, 2, 3, 4, 0
    entries = [(START, 3, dead_end, 1.0)]
    entries += [(START, either, one, 0.5), (START, either, other, 0.5)]
    entries += [(START, one, one, 1.0), (START, other, other, 1.0)]
    entries += [(one, 0, goal, 1.0), (other, 0, goal, 1.0)]
    model = TransitionModel.from_entries(5, 4, *map(np.array, zip(*entries, strict=True)))
    runs = [
        Demonstrations.from_pairs([(START, way), (way, 0)], way, end=goal) for way in (one, other)
    ]
    said = Demonstrations.concatenate(runs)
    learnt = learn("planning", model, said, gamma=GAMMA, rng=np.random.default_rng(0))
    assert learnt.caution == learn_caution(model, said, learnt.reward, GAMMA) > 0
    assert Policy.from_q(learnt.q, model.mask).action[START] in (one, other)
    assert learnt.q[START, either] == pytest.approx(learnt.q[START, one] - learnt.caution / 2)


def test_where_nothing_is_more_certain_than_the_rest_there_is_none(fork):
    sure = TransitionModel.from_entries(
        3, 1, np.array([0, 1]), np.array([0, 0]), np.array([1, 2]), np.ones(2)
    )
    walk = Demonstrations.from_pairs([(0, 0), (1, 0)])
    assert learn_caution(sure, walk, PAYS, GAMMA) == 0
    assert learn_caution(fork, shown(SURE, 8), np.zeros(3), GAMMA) == 0
