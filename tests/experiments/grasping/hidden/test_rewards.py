"""Lessons about hidden rewards, as a person runs them, and by themselves."""

import json

import numpy as np
import pytest

from experiments.grasping.hidden import fixed_budget
from experiments.grasping.hidden.drawn import told_by
from experiments.grasping.hidden.enough import FIXED, counted, is_about
from experiments.grasping.hidden.fixed_budget import THESIS_ANSWERS, after_answers
from experiments.grasping.hidden.lessons import lesson, shared_setting, shown_runs, will_do
from experiments.grasping.hidden.rewards import run_lesson, summary, together
from experiments.grasping.hidden.simple_rules import Watched, as_expected
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.demonstrations import Demonstrations
from irl.posterior import belief as beliefs
from irl.posterior.audit import LENGTHS, Audit
from irl.posterior.enough import LEARNT, REACHES, UNSURE, UNTRIED, EnoughRule, claim
from irl.posterior.learner import GoalConfig, GoalLearner
from irl.posterior.predictions import Predicted


def learnt_rewards(command, folder):
    options = ("--number", 1, "--learners", "goal_posterior", "--noise", "--questions", 0)
    done = command("grasping", "rewards", *options, "--workers", 1, "--out", folder)
    assert done.returncode == 0, done.stderr
    assert "accuracy" in done.stdout
    return json.loads((folder / "result.json").read_text())


def test_rewards_are_learnt_from_one_trajectory(command, tmp_path):
    result = learnt_rewards(command, tmp_path)
    assert not (tmp_path / "measured.json").exists()
    assert result["noisy_rows"] == []
    assert [row["answers"] for row in result["rows"]] == [0]
    assert all(0.9 <= row["success_mdp"] <= 1 for row in result["rows"])  # a region, 4 labels


@pytest.mark.soak
def test_results_do_not_depend_on_workers(command, tmp_path):
    here = run_lesson(str(SHIPPED_TASK), 0, 0, (("goal_posterior",), 0, 0.0))
    assert learnt_rewards(command, tmp_path)["rows"] == here


def test_a_student_has_no_lesson_of_its_own_beside_its_teachers():
    pair = ("goal_posterior", "student")
    assert together((*pair[::-1], "planning")) == [pair, ("planning",)]
    assert together(("student", "fa_mlirl")) == [("student",), ("fa_mlirl",)]


@pytest.mark.soak
def test_a_student_is_taught_in_its_teachers_lesson_what_it_would_be_in_its_own():
    pair = ("goal_posterior", "student")
    setting = shared_setting(str(SHIPPED_TASK), 1000, 1)
    shared = lesson(setting, pair, 14, 0.1)
    alone = [row for name in pair for row in lesson(setting, (name,), 14, 0.1)]
    assert [row["method"] for row in shared] == [pair[0], pair[0], pair[1]]
    assert shared == alone


def test_runs_end_at_the_goal_and_number_as_asked():
    setting = shared_setting(str(SHIPPED_TASK), 1000, 0)
    reward = setting.reward(14)
    shown = shown_runs(setting, reward, 3, np.random.default_rng(0))
    assert np.isin(shown.ends[:, 2], reward.goal_states).all()
    assert np.unique(shown.trajectory).tolist() == [0, 1, 2]
    shown.check(setting.task.model)


@pytest.mark.soak
def test_lessons_that_the_learner_ends(command, tmp_path):
    options = ("--lessons", 1, "--questions", 1, "--about", "nameless", "--fixed", 3)
    options += ("--workers", 1)
    done = command("grasping", "enough", *options, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "result.json").read_text())
    (told,) = result["rows"]
    assert (told["reward"], told["answers"], told["stopped"]) == (7, 1, False)
    assert "tilt" in told["costs"]
    assert (result["lessons"], result["nameless_stopped"]) == (1, 0)
    assert len(result["seconds"]) == 1
    assert "seconds" not in told
    assert result["simple_rules"][-1]["labels_mean"] <= told["labels"] + 2
    assert (tmp_path / "lessons.png").stat().st_size > 10_000


def row(**changed):
    base = {
        "method": "m",
        "answers": 0,
        "label_noise": 0.0,
        "kind": "free",
        "costs": {},
        "success_mdp": 1.0,
        "worst_start": 1.0,
        "accuracy_optimal_all": 0.9,
        "labels": 5,
    }
    return {**base, **changed}


def test_a_cost_without_a_name_is_told_apart():
    rows = [row(), row(costs={"tilt": 0.1}, accuracy_optimal_all=0.5, kind="held")]
    told = {each["rewards"]: each for each in summary(rows)}
    assert told["all"]["accuracy_optimal_all"]["mean"] == 0.7
    assert told["named costs"]["accuracy_optimal_all"]["least"] == 0.9
    assert told["a cost without a name"]["number"] == told["held"]["number"] == 1
    assert "region" not in told


def test_lessons_are_counted():
    rows = [
        {"right": True, "labels": 10, "answers": 4, "costs": {}, "claim": LEARNT},
        {"right": False, "labels": 12, "answers": 8, "costs": {}, "claim": LEARNT},
        {"right": False, "labels": 20, "answers": 16, "costs": {"tilt": 0.1}, "claim": REACHES},
    ]
    early = {"labels": 7, "right": False, "success_mdp": 0.9, "accuracy_optimal_all": 0.5}
    early = {"labels agree": early, FIXED: {**early, "labels": 1299, "right": True}}
    rest = {"checks": 3, "checks_right": 2, "simple": early}
    for each, mistaken in zip(rows, (0, 1, 2), strict=True):
        each["mistaken"] = mistaken
    told = counted([row | rest | {"stopped": row["claim"] == LEARNT} for row in rows], 16)
    assert (told["lessons"], told["stopped"], told["right_share"]) == (3, 2, 0.5)
    assert (told["labels_mean"], told["stopped_labels_mean"]) == (14, 11)
    assert told["nameless_stopped_labels_mean"] is None
    assert told["answers_saved"] == 20 / 3
    assert told["nameless_right_share"] is None
    assert (told["nameless_reaches"], told["named_reaches"]) == (1, 0)
    assert (told["contradicted"], told["contradicted_reaches"]) == (2, 1)
    assert (told["named_contradicted"], told["named_contradicted_reaches"]) == (1, 0)
    assert (told["checks"], told["checks_right"]) == (9, 6)
    agree, unchanged, fixed = told["simple_rules"]
    assert (agree["stopped"], agree["wrong"], agree["labels_mean"]) == (3, 3, 7)
    assert (fixed["wrong"], fixed["labels_mean"], fixed["success_mdp_mean"]) == (0, 1299, 0.9)
    assert (unchanged["stopped"], unchanged["labels_mean"]) == (0, None)


def test_rewards_are_told_by_what_lessons_are_about():
    every = range(40)
    assert [k for k in every if is_about(k, "nameless")] == [7, 19, 27, 39]
    assert [k for k in every if is_about(k, "outside")] == [*range(7), *range(20, 27)]
    assert len([k for k in every if is_about(k, "named")]) == 36
    setting = shared_setting(str(SHIPPED_TASK), 1000, 0, told_by(2)[0])
    assert told_by(2) == ("cell", "face")
    assert "cell" not in setting.problem.factors
    assert "face" in setting.problem.factors


def test_a_lesson_of_a_fixed_length_asks_by_chance_and_learns_from_every_answer(monkeypatch):
    monkeypatch.setattr(fixed_budget, "_ROUNDS", 4)
    assert THESIS_ANSWERS == 1296
    setting = shared_setting(str(SHIPPED_TASK), 1000, 0)
    reward = setting.reward(14)
    shown = shown_runs(setting, reward, 1, np.random.default_rng(0))
    learner = after_answers(setting, reward, shown, 60, np.random.default_rng(1))
    told = learner.shown
    assert len(told) + len(told.ends) == len(shown) + 1 + 60
    assert np.unique(np.concatenate([told.state, told.ends[:, 2]])).size == len(told) + 1
    true = setting.judged(reward, learner.q, told)
    assert true["success_mdp"] == 1
    assert true["accuracy_optimal_all"] > 0.97
    # Weighed a few at a time, hypotheses are as likely as all at once.
    belief, all_at_once = learner.belief, learner.belief.log_likelihood
    monkeypatch.setattr(beliefs, "_AT_ONCE", 40 * belief.evidence.pairs.size)
    belief.observe(told)
    np.testing.assert_allclose(belief.log_likelihood, all_at_once, atol=1e-3)


def test_simple_rules_say_when_they_would_have_ended_a_lesson():
    setting = shared_setting(str(SHIPPED_TASK), 1000, 0)
    learner = GoalLearner(
        setting.problem, rng=np.random.default_rng(0), config=GoalConfig(rounds=0)
    )
    reward, rng = setting.reward(14), np.random.default_rng(0)
    learner.learn(shown_runs(setting, reward, 1, rng))
    ended = []
    watched = Watched(lambda rule, learner: ended.append((rule, len(learner.shown))))
    labels = len(learner.shown)
    states = np.setdiff1d(np.flatnonzero(~learner.arrived), learner.shown.state)
    for k, state in enumerate(rng.choice(states[learner.action[states] >= 0], 5, replace=False)):
        action = int(learner.action[state])
        answer = Demonstrations.from_pairs([(int(state), action)], 50 + k)
        assert as_expected(learner, answer)
        watched.take(learner, answer)
    assert ("labels agree", labels + 5) in ended
    goal = Demonstrations.from_pairs([], 60, end=int(reward.goal_states[0]))
    assert as_expected(learner, goal)
    assert not as_expected(learner, Demonstrations.from_pairs([], 60, end=int(states[0])))


class Told:
    """A learner that predicts what it is told to, and was confirmed if told so."""

    def __init__(self, success=1.0, accuracy=0.99, ends=1.0, confirmed=False, mistaken=0):
        self.predicted = Predicted(success, accuracy)
        self.ends_agree, self.mistaken = ends, mistaken
        self.audit = Audit(0 if confirmed else LENGTHS[0])
        self.shown, self.sought, self.untried_goal = None, 0, None

    def learn(self, shown):
        """Nothing is found."""
        self.sought += 1


def test_what_a_learner_may_claim():
    assert claim(Told()) == UNTRIED
    assert claim(Told(confirmed=True)) == claim(Told(confirmed=True, mistaken=1)) == LEARNT
    assert claim(Told(ends=0.0, confirmed=True)) == claim(Told(success=0.9)) == UNSURE
    assert claim(Told(accuracy=0.9, confirmed=True)) == claim(Told(mistaken=1)) == REACHES
    untried = Told(confirmed=True)
    untried.untried_goal = 5
    assert claim(untried) == UNSURE


def test_an_audit_begins_when_predictions_are_good_twice_in_a_row():
    rule, asks = EnoughRule(), []
    for accuracy in (1.0, 0.9, 1.0, 1.0):
        learner = Told(accuracy=accuracy)
        assert not rule(learner)
        learner.question, learner.audit_question = lambda: "telling", lambda: "by chance"
        asks.append(rule.question(learner))
    assert asks == ["telling"] * 3 + ["by chance"]
    assert learner.sought == 1
    assert rule(Told(confirmed=True))


def test_what_is_found_before_an_audit_puts_it_off():
    class Finds(Told):
        def learn(self, shown):
            self.predicted = Predicted(1.0, 0.9)

    rule = EnoughRule()
    learner = Finds()
    assert [rule(learner), rule(learner)] == [False, False]
    assert not rule.audits(learner)


def test_who_is_asked_lets_pass_what_is_as_good_and_corrects_the_rest():
    setting = shared_setting(str(SHIPPED_TASK), 1000, 0)
    reward, rng = setting.reward(14), np.random.default_rng(0)
    best = reward.oracle.optimal_actions
    state = int(np.flatnonzero((best.sum(axis=1) > 1) & ~best.all(axis=1))[0])
    good = np.flatnonzero(best[state])[-1]
    bad = np.setdiff1d(setting.task.model.actions_of(state), np.flatnonzero(best[state]))[0]
    for _ in range(5):
        assert will_do(reward, state, int(good), rng) == good
        assert best[state, will_do(reward, state, int(bad), rng)]
        assert best[state, will_do(reward, state, None, rng)]
