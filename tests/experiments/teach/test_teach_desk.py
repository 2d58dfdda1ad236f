"""The desk: every answer once and on disk, episodes, taking back, rounds; and Algorithm 4.1."""

import subprocess
import sys

import numpy as np
import pytest
import torch

from experiments.grasping.learning import FACTORED, network_features
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.desk import Desk
from experiments.teach.rounds import LocalLearner
from experiments.teach.shell.scripted import demonstrated
from experiments.teach.students import student_config
from experiments.teach.worlds import robot_world
from irl.active import ActiveConfig, active_fa_mlirl
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import DONE, Asked, Result, Round
from irl.lesson_replay import began, replay
from irl.lesson_taught import Taught
from irl.policy import Policy
from irl.session import policy_hash
from irl.student import Order, Student
from irl.task_data import load_task
from irl.teacher import Teacher
from tests.experiments.teach.desks import (
    GOAL,
    GOALS,
    NETWORK,
    SHORT,
    WORLD,
    best,
    teach,
)

torch.set_num_threads(1)


@pytest.mark.parametrize("initial", [None, [(0, 0), (1, 0), (2, 0)]], ids=["empty", "initial"])
def test_a_synchronous_desk_learns_what_the_algorithm_learns_from_the_same_answers(desk, initial):
    first = None if initial is None else Demonstrations.from_pairs(initial)
    at = desk(NETWORK, first, synchronous=True)
    if initial is None:  # the first trajectory is what the algorithm begins with
        while at.learnt is None:
            at.answer(at.question.token, best(at.question.state))
        first = at.taught.demonstrations()
    asked = []
    for _ in range(6):
        asked.append(at.question.state)
        at.answer(at.question.token, best(at.question.state))

    class Oracle:
        def __init__(self):
            self.asked = []

        def trajectory(self, state, rng, max_steps=50):
            assert state == asked[len(self.asked)]
            self.asked.append(state)
            return [] if state == GOAL else [(state, best(state))]

    settings = ActiveConfig(**SHORT, budget=6, cluster_query="none")
    teacher, rng = Teacher(Oracle()), np.random.default_rng(3)
    result = active_fa_mlirl(WORLD.subject.problem, first, teacher, settings, rng=rng)
    task_hash = WORLD.subject.task_hash
    wanted = Policy.from_q(result.q, WORLD.model.mask, task_hash=task_hash)
    assert at.learnt.policy_hash == policy_hash(wanted)
    rounds = [event for event in at.lesson.events if isinstance(event, Round)]
    assert [event.k for event in rounds] == list(range(7))
    assert replay(at.lesson, WORLD.subject).same


def test_an_episode_goes_on_where_its_last_answer_led(desk):
    at = desk()
    first = at.question
    given = at.answer(first.token, best(first.state))
    assert at.question.state == given.outcome
    assert (at.question.trajectory, at.question.step) == (first.trajectory, 1)
    while at.question.strategy == "episode":
        assert at.learnt is None  # nobody learns a goal from a trajectory that goes on still
        at.answer(at.question.token, best(at.question.state))
    run = at.taught.run(first.trajectory)
    assert run.ends[:, 2].tolist() == [GOAL]
    run.check(WORLD.model)
    assert at.learnt is not None and at.question.trajectory != first.trajectory
    assert at.question.proposed == at.policy.action[at.question.state]


def test_an_outcome_that_the_model_knows_nothing_of_leaves_a_gap(desk):
    at = desk()
    first = at.question
    action, far = int(WORLD.model.actions_of(first.state)[0]), 0 if first.state > 20 else 48
    at.answer(first.token, action, outcome=far)
    assert at.question.state == far and at.question.step == 2
    at.answer(at.question.token, best(far))
    at.taught.run(first.trajectory).check(WORLD.model)


def test_a_double_press_and_a_message_sent_again_are_nothing(desk):
    at = desk()
    token = at.question.token
    assert at.answer(token, best(at.question.state)).accepted
    n = len(at.lesson.events)
    assert not at.answer(token, best(at.question.state)).accepted
    assert not at.answer("made up", 0).accepted
    assert at.undo("u1") is not None and at.undo("u1") is None
    assert len(at.lesson.events) == n + 2  # undo, and the question asked again
    at = desk()
    assert not at.answer(token, best(at.question.state)).accepted


def test_after_a_restart_the_same_question_is_open_under_the_same_token(desk):
    at = desk()
    teach(at, 5)
    before = at.question
    again = desk()
    assert again.question.token == before.token and again.question.state == before.state
    assert again.learnt is not None  # it learnt anew what had been said
    rounds = [event for event in again.lesson.events if isinstance(event, Round)]
    assert rounds[-1].fresh and rounds[0].fresh and sum(e.fresh for e in rounds) == 2
    assert replay(again.lesson, WORLD.subject).same


def test_what_was_taken_back_is_asked_again_at_any_depth_also_after_a_restart(desk):
    at = desk()
    asked = []
    for _ in range(6):
        asked.append((at.question.state, at.question.trajectory, at.question.step))
        teach(at, 1)
    at = desk()
    for k, moment in enumerate(reversed(asked)):
        assert at.undo(f"u{k}") is not None
        assert (at.question.state, at.question.trajectory, at.question.step) == moment
        assert at.question.strategy == "again"
    assert at.undo("more") is None and not at.taught.answers
    teach(at, 1)
    assert len(at.taught.answers) == 1


def test_an_edited_answer_holds_in_its_old_place(desk):
    at = desk()
    teach(at, 4)
    number, answer = next(iter(at.taught.answers.items()))
    other = next(a for a in WORLD.model.actions_of(answer.state).tolist() if a != answer.action)
    assert at.edit(number, other, "e1") and not at.edit(number, other, "e1")
    assert at.taught.answers[number].action == other
    with pytest.raises(InputError, match="no answer 1 holds"):
        at.edit(1, other, "e2")
    with pytest.raises(InputError, match="not feasible"):
        at.edit(number, 77, "e3")
    assert at.undo("u") is not None and at.taught.answers[number] == answer


def test_a_question_may_be_put_aside(desk):
    at = desk()
    teach(at, 8)
    aside = at.question
    assert at.skip(aside.token) and not at.skip(aside.token)
    assert aside.state in at.taught.skipped and at.question.state != aside.state
    later = at.question
    assert at.another(later.token) and at.question.token != later.token
    assert not at.another(later.token)


def test_advice_counts_states_and_what_it_contradicts(desk):
    at = desk()
    teach(at, 8)
    number, answer = next((n, a) for n, a in at.taught.answers.items() if a.action != DONE)
    name = next(n for n, s in WORLD.clusters.items() if answer.state in s)
    given = at.advise(name, [], [answer.action], "a1")
    assert given.accepted and given.states == len(WORLD.clusters[name])
    assert number in given.contradicted
    assert not at.advise(name, [], [answer.action], "a1").accepted
    assert at.advise("left ∩ above", [0], [], "a2").states == 9
    assert at.make_cluster("right ∩ below", "c1") == 9
    for cluster, good, bad in (("no", [], []), ("left ∩ right", [0], []), ("left", [1], [1])):
        with pytest.raises(InputError):
            at.advise(cluster, good, bad, "a3")
    excluded = at.policy.action[np.intersect1d(WORLD.clusters[name], WORLD.model.acting)]
    assert not (excluded == answer.action).any()


def test_corrections_of_a_playing_policy_become_a_run(desk):
    at = desk()
    teach(at, 8)
    question = at.question
    first = at.correct(8, 0, "c1")
    second = at.correct(9, 0, "c2", after=first)
    third = at.correct(40, 3, "c3", after=second)  # not where the second can have led
    assert at.correct(40, 3, "c3", after=second) is None
    run = at.taught.run(at.taught.answers[first].trajectory)
    assert run.pairs == [(8, 0), (9, 0), (40, 3)] and run.step.tolist() == [0, 1, 3]
    assert at.taught.answers[third].preselected is not None
    assert at.question.token == question.token
    run.check(WORLD.model)


def test_the_robot_acts_alone_where_it_is_let_and_that_is_no_demonstration(desk):
    at = desk()
    teach(at, 12)
    at.begin_run(0)
    before, asked = dict(at.taught.answers), at.question
    given = at.act(asked.token)
    assert given.outcome == at.question.state and at.question.step == 1
    assert at.taught.answers == before
    assert not at.act(asked.token).accepted


def test_every_tenth_answer_is_held_out_if_the_teacher_wishes(desk):
    at = desk(hold_out=True)
    teach(at, 30)
    out = [n for n, a in at.taught.answers.items() if a.purpose == "held_out"]
    assert 2 <= len(out) <= 3
    learnt_from = at.learner.student._session.state.labels
    for number in out:
        answer = at.taught.answers[number]
        same = (learnt_from.trajectory == answer.trajectory) & (learnt_from.step == answer.step)
        assert not same.any()


def test_a_learner_that_was_started_anew_does_a_fresh_round(desk):
    at = desk(NETWORK)
    teach(at, 7)
    at.learner.student = Student(WORLD.subject, NETWORK, at.lesson.initial)
    at.learner.lost = True
    teach(at, 3)
    rounds = [event for event in at.lesson.events if isinstance(event, Round)]
    assert sum(event.fresh for event in rounds) == 2
    assert replay(at.lesson, WORLD.subject).same


class Slow(LocalLearner):
    """Ends a round only when told."""

    ready = False

    def poll(self):
        return super().poll() if self.ready else None


def test_answers_are_taken_while_the_learner_learns_and_the_replay_does_not_mind(tmp_path):
    lesson = Lesson.begin(tmp_path / "l.db", began(WORLD.subject, NETWORK))
    learner = Slow(Student(WORLD.subject, NETWORK, lesson.initial))
    at, rng = Desk(WORLD, lesson, learner), np.random.default_rng(0)
    for _ in range(25):
        learner.ready = bool(rng.random() < 0.3)
        teach(at, 1)
        at.tick()
    learner.ready = True
    while at.tick():
        pass
    rounds = [event for event in lesson.events if isinstance(event, Round)]
    results = [event for event in lesson.events if isinstance(event, Result)]
    assert 2 < len(rounds) < 15 and len(results) == len(rounds)
    assert len(at.taught.answers) == 25
    assert replay(lesson, WORLD.subject).same
    lesson.close()


def test_it_says_that_it_is_enough_and_is_right(desk):
    at = desk(GOALS)
    for _ in range(60):
        if at.enough.enough:
            break
        teach(at, 1)
    assert at.enough.enough and "that I did not choose" in at.enough.reason
    assert WORLD.success(at.policy.action) == 1.0
    tests = [e for e in at.lesson.events if isinstance(e, Asked) and e.purpose == "audit"]
    assert len(tests) >= 12
    assert Taught.of(at.lesson.events).answers == at.taught.answers


def test_why_a_question_is_asked_is_told_in_shares_and_words(desk):
    at = desk()
    teach(at, 10)
    for _ in range(5):
        why = at.question.why
        assert all(0 <= share <= 1 for share in (why.doubt, why.visited, why.new))
        assert why.words.endswith(".") and at.question.words.startswith("column")
        assert set(at.question.top) <= set(at.question.feasible)
        teach(at, 1)


def test_who_only_asks_and_answers_loads_no_torch():
    code = "import sys, experiments.teach.story; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_networks_see_of_the_robots_task_what_they_see_in_the_demo():
    world, task = robot_world(SHIPPED_TASK), load_task(SHIPPED_TASK)
    assert np.array_equal(world.subject.problem.features, network_features(task, FACTORED))
    assert world.subject.task_hash == task.task_hash


def test_planning_learns_the_robots_task_in_short_rounds():
    world = robot_world(SHIPPED_TASK)
    shown = demonstrated(world, 1, np.random.default_rng(0))
    student, counted = Student(world.subject, student_config("planning", 0), shown), []
    learnt = student.learn(Order(0, True, []), lambda p: counted.append(p.iteration))
    assert max(counted) <= 10 and learnt.policy.action.shape == (world.model.n_states,)
    assert world.success(learnt.policy.action) > 0.99
