"""What a lesson comes to: planted errors found, what was held out, ten minutes, and its size."""

import numpy as np
import pytest
import torch

from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.desk import Desk, DeskConfig
from experiments.teach.review import report
from experiments.teach.rounds import LocalLearner
from experiments.teach.shell.scripted import SECONDS, answer_as_the_oracle, would_say
from experiments.teach.worlds import grid_world, robot_world
from irl.demonstrations import Demonstrations
from irl.lesson import Lesson
from irl.lesson_events import DONE, Answered, Asked, Result
from irl.lesson_odds import odds
from irl.lesson_replay import began
from irl.posterior.evidence import BETAS, EPSILONS
from irl.posterior.learner import GoalLearner
from irl.student import Student, StudentConfig
from tests.experiments.teach.planted import found, lesson

torch.set_num_threads(1)
WORLD = grid_world(7)
ROBOT = pytest.param("robot", 20, marks=pytest.mark.soak)


def world(name: str):
    return WORLD if name == "grid" else robot_world(SHIPPED_TASK)


def begun(path, taught=WORLD, learner="goal_posterior", wrap=LocalLearner, **how) -> Desk:
    config = StudentConfig(learner)
    made = Lesson.begin(path, began(taught.subject, config))
    return Desk(
        taught, made, wrap(Student(taught.subject, config, made.initial)), DeskConfig(**how)
    )


@pytest.mark.parametrize(("name", "lessons"), [("grid", 4), ROBOT])
@pytest.mark.parametrize("share", [0.1, 0.3])
def test_planted_errors_are_early_in_the_list_of_odd_answers(tmp_path, name, lessons, share):
    taught, hits, planted = world(name), 0, 0
    for seed in range(lessons):
        desk, wrong = lesson(taught, tmp_path / f"{seed}.db", 60, share, seed)
        assert len(desk.taught.answers) >= 60
        hit, there = found(desk, wrong)
        hits, planted = hits + hit, planted + there
        desk.lesson.close()
    assert planted > 0.6 * share * 60 * lessons
    assert hits >= 0.9 * planted


def test_a_likelihood_without_an_answer_is_that_of_a_lesson_that_never_had_it():
    problem, goal = WORLD.subject.problem, int(WORLD.goal_states[0])
    run = Demonstrations.from_pairs([(21, 0), (22, 0), (23, 0)], 0, "human", end=goal)
    odd = Demonstrations.from_pairs([(45, 0)], 1, "human")  # along the edge, away from below
    both = Demonstrations.concatenate([run, odd])
    right, wrong = odds(problem, both, [(22, 0), (45, 0)], np.random.default_rng(0))
    assert right.ratio == pytest.approx(1, abs=0.05) and wrong.ratio < 0.2

    # The same hypotheses, weighed by the run alone, and what they say of the action.
    learner = GoalLearner(problem, rng=np.random.default_rng(0))
    learner.learn(both)
    care = np.unravel_index(learner.belief.care.argmax(), learner.belief.care.shape)
    beta, epsilon = BETAS[care[0]], EPSILONS[care[1]]
    learner.belief.observe(run)
    pairs = WORLD.model.first_pair[45] + np.arange(WORLD.model.widths[45])
    q = learner.belief.values_of(np.arange(learner.belief.goal.size), pairs)
    p = np.exp(beta * (q - q.max(axis=0)))
    p = (1 - epsilon) * p / p.sum(axis=0) + epsilon / len(pairs)
    p *= np.where(learner.belief.members(learner.belief.goal)[45], 0.01, 0.99)
    row = int(WORLD.model.pair_index(45, 0) - WORLD.model.first_pair[45])
    assert wrong.likelihood == pytest.approx(float(p[row] @ learner.belief.weight), rel=0.3)


def test_a_report_tells_contradictions_coverage_time_and_what_was_held_out(tmp_path):
    desk = begun(tmp_path / "l.db", learner="behaviour_cloning", hold_out=True)
    answer_as_the_oracle(desk, 45, np.random.default_rng(0))
    number, answer = next((n, a) for n, a in desk.taught.answers.items() if a.action != DONE)
    other = next(a for a in WORLD.model.actions_of(answer.state) if a != answer.action)
    desk.correct(answer.state, int(other), "c1")
    name = next(n for n, states in WORLD.clusters.items() if answer.state in states)
    desk.advise(name, [], [answer.action], "a1")
    told = report(desk)
    assert told["answers"] == 46
    kinds = {(c["kind"], c["state"]) for c in told["contradictions"]}
    assert {("answers", answer.state), ("advice", answer.state)} <= kinds
    assert number in next(c for c in told["contradictions"] if c["kind"] == "advice")["answers"]
    assert told["seconds"]["median"] == SECONDS and told["seconds"]["total"] == 45 * SECONDS
    held = [a for a in desk.taught.answers.values() if a.purpose == "held_out"]
    low, high = told["held_out"]["interval"]
    assert told["held_out"]["answers"] == len(held) >= 3 and 0 <= low < high <= 1
    same = sum(desk.policy.action[a.state] == a.action for a in held)
    assert told["held_out"]["agreed"] == same
    states = {a.state for a in desk.taught.answers.values()}
    assert told["coverage"]["states"] == len(states)
    assert told["coverage"]["factors"]["x"][1] == 7
    rows = told["at_odds"]
    assert len(rows) == 46 - len(held) and rows[0]["ratio"] <= rows[-1]["ratio"]
    desk.lesson.close()


class Timed(LocalLearner):
    """A round takes as long as so many answers."""

    answers = 3
    left = 0

    def start(self, order):
        super().start(order)
        self.left = self.answers

    def poll(self):
        self.left -= 1
        return super().poll() if self.left <= 0 else None


@pytest.mark.parametrize("name", ["grid", pytest.param("robot", marks=pytest.mark.soak)])
def test_ten_minutes_of_a_scripted_teacher_are_enough_and_it_says_so(tmp_path, name):
    taught, rng = world(name), np.random.default_rng(5)
    desk = begun(tmp_path / "l.db", taught, wrap=Timed)
    for _ in range(int(600 / SECONDS)):
        if desk.enough.enough:
            break
        asked = desk.question
        action = would_say(taught, asked.state, asked.proposed, rng)
        desk.answer(asked.token, action, seconds=SECONDS)
    assert desk.enough.enough and not desk.enough.stands_in
    assert taught.success(desk.policy.action) >= 0.99
    desk.lesson.close()


class Canned(LocalLearner):
    """Learns once, and has that ready at every round."""

    first = None

    def start(self, order):
        if self.first is None:
            super().start(order)
            self.first = super().poll()
        self.k = order.k

    def poll(self):
        k, self.k = getattr(self, "k", None), None
        return None if k is None else type(self.first)(**vars(self.first) | {"k": k})


@pytest.mark.parametrize("answers", [100, pytest.param(1000, marks=pytest.mark.soak)])
def test_a_lesson_of_a_thousand_answers_is_small(tmp_path, answers):
    desk = begun(tmp_path / "l.db", wrap=Canned)
    rng = np.random.default_rng(0)
    for _ in range(answers):
        asked = desk.question
        action = would_say(WORLD, asked.state, None, rng)
        desk.answer(asked.token, action, seconds=12.345, previews=2)
    ahead = (tmp_path / "l.db-wal").stat().st_size
    desk.lesson.close()
    kinds = [type(event) for event in desk.lesson.events]
    # With a question, an answer and a round each: more than in a lesson where rounds take a while.
    assert min(kinds.count(kind) for kind in (Asked, Answered, Result)) > 0.8 * answers
    assert (tmp_path / "l.db").stat().st_size < 3e6 * answers / 1000 and ahead < 1e6
