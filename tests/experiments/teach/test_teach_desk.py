"""The desk: every answer once and on disk, episodes, taking back, rounds; and Algorithm 4.1."""

import subprocess
import sys

import numpy as np
import pytest
import torch

from experiments.grasping.learning import FACTORED, network_features
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.desk import Desk, DeskConfig
from experiments.teach.rounds import LocalLearner
from experiments.teach.scripted import demonstrated
from experiments.teach.students import student_config
from experiments.teach.terminal import show
from experiments.teach.worlds import grid_world, robot_world
from irl.active import ActiveConfig, active_fa_mlirl
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import DONE, Asked, Result, Round
from irl.lesson_replay import began, replay
from irl.lesson_taught import Taught
from irl.policy import Policy
from irl.session import Question, policy_hash
from irl.student import Order, Student, StudentConfig
from irl.task_data import load_task
from irl.teacher import Teacher

torch.set_num_threads(1)

WORLD = grid_world(7)
GOAL = int(WORLD.goal_states[0])
SHORT = {
    "initial": {"iterations": 60, "step": 0.01, "beta": 70.0},
    "refine": {"iterations": 20, "step": 0.01, "beta": 70.0},
    "hidden": [16],
    "state_query": "visitation_entropy",
}
CLONING, GOALS = StudentConfig("behaviour_cloning"), StudentConfig()
NETWORK = StudentConfig("fa_mlirl", seed=3, options=SHORT)


def best(state: int) -> int:
    return DONE if state == GOAL else int(np.flatnonzero(WORLD.oracle.optimal_actions[state])[0])


class Lost(LocalLearner):
    """A learner that is started anew when told so."""

    def start(self, order):
        self.lost = False
        super().start(order)


@pytest.fixture
def desk(tmp_path):
    opened = []

    def open_desk(config=CLONING, initial=None, **how) -> Desk:
        path = tmp_path / "lesson.db"
        for lesson in opened:
            lesson.close()
        if path.exists():
            lesson = Lesson(path)
        else:
            lesson = Lesson.begin(path, began(WORLD.subject, config, initial))
        opened.append(lesson)
        learner = Lost(Student(WORLD.subject, config, lesson.initial))
        return Desk(WORLD, lesson, learner, DeskConfig(**how))

    yield open_desk
    for lesson in opened:
        lesson.close()


def teach(desk: Desk, answers: int) -> None:
    for _ in range(answers):
        asked = desk.question
        good = WORLD.oracle.optimal_actions[asked.state]
        proposed = asked.proposed
        lets_pass = proposed not in (None, DONE) and good[proposed]
        assert desk.answer(asked.token, proposed if lets_pass else best(asked.state)).accepted


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
    assert at.enough.enough and "drawn by chance" in at.enough.reason
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


def test_planning_learns_the_robots_task_in_short_rounds():
    world = robot_world(SHIPPED_TASK)
    shown = demonstrated(world, 1, np.random.default_rng(0))
    student, counted = Student(world.subject, student_config("planning", 0), shown), []
    learnt = student.learn(Order(0, True, []), lambda p: counted.append(p.iteration))
    assert max(counted) <= 10 and learnt.policy.action.shape == (world.model.n_states,)
    assert world.success(learnt.policy.action) > 0.99
