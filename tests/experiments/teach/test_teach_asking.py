"""What is asked next: what tells most for the teacher's time, and where the robot is sure."""

import numpy as np
import pytest
import torch

from experiments.teach.desk import Desk
from experiments.teach.rounds import LocalLearner
from experiments.teach.shell.terminal import show
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import DONE
from irl.lesson_replay import began
from irl.session import GOAL, Question
from irl.student import Student
from tests.experiments.teach.desks import CLONING, GOALS, WORLD, best, teach

torch.set_num_threads(1)


def test_after_the_first_trajectory_it_says_what_tells_most_for_the_teachers_time(desk, capsys):
    at = desk(GOALS)
    while at.learnt is None:
        assert at.suggestion is None
        at.answer(at.question.token, best(at.question.state), seconds=5.0)
    gain, state = at.learnt.gain, at.question.state
    told = gain[[a.state for a in at.taught.answers.values()]]
    assert (told[np.isfinite(told)] == 0).all()  # what was said once tells nothing again
    assert at.suggestion.worth.gain > 0 and at.suggestion.worth.seconds > 0
    # One state by itself tells 0.8 bits, at 8 s before this teacher was timed; nothing else does.
    gain[:] = 0.0
    gain[state] = 0.8 * np.log(2)
    show(at, at.question)
    assert at.suggestion.kind == "state" and at.suggestion.worth.offer.state == state
    assert "one state by itself (0.8 bits in 8 s)" in capsys.readouterr().out
    # Where it leads to tells as much, and to go on costs 5 s.
    at.answer(at.question.token, best(state), seconds=3000.0)
    came, gain = at.question, at.learnt.gain
    assert came.step
    gain[:] = 0.01
    gain[came.state] = 0.5
    assert at.suggestion.kind == "step" and at.suggestion.worth.seconds == 5.0
    gain[:] = 0.01  # alike everywhere, and advice takes this teacher no time
    name = next(iter(WORLD.clusters))
    at.advise(name, [], [], "advice", seconds=0.01)
    at.learnt.gain[:] = 0.01
    assert at.suggestion.kind == "advice" and at.suggestion.worth.offer.cluster != name
    assert at.taught.advised[-1].seconds == 0.01


def test_who_knows_the_goal_knows_where_the_teacher_could_toss_a_coin(desk):
    at = desk(GOALS)
    for _ in range(40):
        if at.enough.enough:
            break
        teach(at, 1)
    even = at.learnt.toss_up
    assert even.any() and not at.learnt.gain[even].any()
    assert (WORLD.oracle.optimal_actions[even].sum(axis=1) > 1).all()


def test_a_toss_up_is_not_asked_and_a_synchronous_desk_asks_what_the_algorithm_would(desk):
    at = desk(GOALS)
    while at.learnt is None:
        at.answer(at.question.token, best(at.question.state))
    queue, at.asking.leads = [q for q in at.asking.queue if q.purpose == "learn"], False
    assert len(queue) > 1
    at.learnt.toss_up[queue[0].state] = True
    at.another(at.question.token)
    assert at.question.state == queue[1].state
    at.asking.queue, at.asking.synchronous = list(queue), True
    assert at.suggestion is None
    at.another(at.question.token)
    assert at.question.state == queue[0].state


def taught_once(desk):
    """After one trajectory, at a start; gains and certainty are the test's to set."""
    at = desk(GOALS)
    while at.learnt is None:
        at.answer(at.question.token, best(at.question.state), seconds=4.0)
    at.rounds.learner = Resting()
    at.asking.queue = [Question(10, "information", 0.0), Question(38, "information", 0.0)]
    at.learnt.toss_up[:] = False
    at.learnt.gain[:], at.learnt.sure[:] = 0.01, 0.5
    return at


class Resting:
    """Learns nothing more."""

    lost = False

    def start(self, order):
        pass

    def poll(self):
        return None


def test_the_kind_of_question_is_chosen_by_what_it_tells_for_the_teachers_time(desk):
    at = taught_once(desk)
    at.learnt.gain[38] = 2.0  # the second of the queue, by itself
    at.another(at.question.token)
    assert (at.question.strategy, at.question.state) == ("information", 38)
    at.learnt.gain[:] = 0.5  # alike everywhere: many answers, of which all but one are cheap
    at.another(at.question.token)
    assert at.question.strategy == "run"
    # Where it leads to tells as much as another state, for less: it goes on.
    at.answer(at.question.token, at.question.feasible[0], seconds=4.0)
    assert at.question.step == 1
    at.learnt.gain[:] = 0.01
    at.learnt.gain[10] = 5.0
    at.answer(at.question.token, best(at.question.state), seconds=4.0)
    assert (at.question.step, at.question.state) == (0, 10)  # left, for what tells ten times that


def test_what_is_taken_for_a_goal_is_asked_about_before_what_tells_more(desk):
    at = taught_once(desk)
    at.asking.queue.insert(0, Question(12, GOAL, 0.0, DONE))
    at.learnt.gain[38] = 2.0
    at.another(at.question.token)
    assert (at.question.strategy, at.question.state) == (GOAL, 12)
    assert at.question.why.words == "I take this for done, as where you ended: is it?"
    at.another(at.question.token)
    assert at.question.state == 38


@pytest.mark.parametrize(
    "why", ["sure", "unknown", "led by the teacher", "tests come next", "little to gain"]
)
def test_an_episode_goes_on_where_the_robot_is_sure_or_another_leads(desk, why):
    at = taught_once(desk)
    at.begin_run(0)
    at.learnt.gain[10] = 5.0
    at.learnt.sure[:] = 0.99 if why == "sure" else 0.5
    if why == "unknown":
        at.learnt.gain[:8] = np.nan
    if why == "little to gain":
        at.learnt.gain[10] = 0.05
    if why == "led by the teacher":
        at.asking.leads = False
    if why == "tests come next":
        at.asking.queue.insert(0, Question(20, "test", 0.0, 0, "audit"))
    at.answer(at.question.token, 0, seconds=4.0)
    assert (at.question.step, at.question.state) == (1, 1)


def test_a_question_that_is_open_shows_what_was_learnt_meanwhile(tmp_path):
    class Waiting(LocalLearner):
        ready = True

        def poll(self):
            return super().poll() if self.ready else None

    lesson = Lesson.begin(tmp_path / "lesson.db", began(WORLD.subject, GOALS))
    learner = Waiting(Student(WORLD.subject, GOALS, lesson.initial))
    at = Desk(WORLD, lesson, learner)
    learner.ready = False
    teach(at, 20)
    asked = at.question
    assert at.learnt is None and asked.proposed is None and asked.why.doubt == 1.0
    learner.ready = True
    at.tick()
    now = at.question
    assert (now.token, now.state, now.number) == (asked.token, asked.state, asked.number)
    assert now.proposed is not None and now.top and now.why.doubt < 1.0
    number = at.answer(now.token, best(now.state)).number
    assert at.taught.answers[number].preselected == now.proposed
    lesson.close()


def test_a_state_that_the_teacher_picks_is_asked_about(desk):
    at = desk(CLONING)
    at.ask(17)
    assert (at.question.state, at.question.strategy, at.question.step) == (17, "picked", 0)
    with pytest.raises(InputError, match="no state 99"):
        at.ask(99)
