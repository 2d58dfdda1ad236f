"""Measurements on the network of Algorithm 4.1, with trainings of a few iterations."""

import json
from functools import partial

import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments.grasping.tables import advice, ladder, questions, table
from experiments.grasping.tables.learners import LEARNERS, OURS, THESIS, with_everything
from experiments.grasping.tables.lesson import ADVICE, Lesson, shared_teacher
from experiments.grasping.tables.pictures import draw_curves, draw_matrix
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KEPT, KeptRows
from experiments.kit.shipped_data import SHIPPED_TASK

FOLDER = str(SHIPPED_TASK)


def short(learner, labels=40):
    few = learner.with_training(iterations=3).with_learning(demonstrations=labels)
    return few.with_active(refine=few.learning.active.initial, hidden=(8,))


@pytest.fixture(scope="module")
def teacher():
    return shared_teacher(FOLDER)


@pytest.fixture(scope="module")
def problem(teacher):
    return Lesson.begin(teacher, short(OURS), 0).problem


def test_left_in_what_cannot_be_done_is_worth_nothing(problem):
    whole = with_everything(problem)
    acting = problem.model.widths > 0
    assert (whole.model.widths[:-1][acting] == whole.model.n_actions).all()
    assert whole.fixed_vr[problem.model.n_states] == 0.0
    f = np.linspace(0.1, 0.9, whole.model.n_states)
    f[-1] = 0.0
    q, own = whole.model.q_values(f), problem.model.q_values(f[:-1])
    mask = problem.model.mask
    assert np.allclose(q[:-1][mask], own[mask])
    assert (q[:-1][acting][~mask[acting]] == 0).all()


@pytest.fixture(scope="module")
def outcome():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(table, "LEARNERS", {name: short(each) for name, each in LEARNERS.items()})
        patch.setattr(table, "MOST", {"random": 80, "active": 60})
        return [table.taught(FOLDER, (name, 0)) for name in ("thesis", "fa_mlirl")]


def test_the_table_has_a_cell_for_each_set_and_kind_of_advice(outcome):
    rows = [row for each in outcome for row in each["rows"]]
    json.dumps(rows)
    cells = table.tabulated(rows)
    assert len(cells) == 2 * 3 * 4
    ours = {(r["demonstration_set"], r["advice"]): r for r in cells if r["method"] == "fa_mlirl"}
    assert [ours[name, "none"]["labels"] for name in table.SETS] == [[40], [80], [60]]
    assert ours["initial", "none"]["answers"] == [0] < ours["random", "none"]["answers"]
    for name in ("initial", "random", "active"):
        # Avoided actions are never right, so that leaving them out can only help.
        assert (
            ours[name, "action"]["accuracy_optimal_all"]
            > ours[name, "none"]["accuracy_optimal_all"]
        )
    for row in rows:
        assert 0 <= row["strict_of_ceiling"] <= 1
        assert row["accuracy_optimal"] >= row["accuracy_strict"]


def test_one_training_serves_all_sets(outcome):
    for each in outcome:
        random, active = each["curves"]["random"], each["curves"]["active"]
        assert random[0] == active[0]
        assert random[-1]["demonstrated"] == 80


def test_the_table_is_drawn_beside_the_thesis(outcome):
    rows = table.tabulated([row for each in outcome for row in each["rows"]])
    figure = Figure()
    draw_matrix(figure, rows, table.THESIS_TABLE, ADVICE)
    titles = [axis.get_title() for axis in figure.axes]
    assert titles[0] == "printed in the thesis: the same action"
    assert [text.get_text() for text in figure.axes[0].texts][:3] == ["8%", "15%", "19%"]
    assert len([title for title in titles if title]) == 5
    figure = Figure()
    draw_curves(figure, [each["curves"] for each in outcome])
    assert len(figure.axes[0].get_lines()) == 4


def test_gains_are_measured_on_the_same_seeds(monkeypatch):
    monkeypatch.setattr(advice, "OURS", short(OURS))
    rows = [row for seed in (0, 1) for row in advice.advised(FOLDER, (0.0, 0.5), (20, seed))]
    told = {name: advice.gains(rows, labels=20, advice=name) for name in ADVICE}
    assert told["none"]["gain"]["success_mdp"] == [0, 0, 0]
    action = told["action"]
    gained = np.subtract(action["accuracy_optimal_all"], told["none"]["accuracy_optimal_all"])
    assert action["gain"]["accuracy_optimal_all"][0] == pytest.approx(gained.mean())
    assert gained.min() > 0
    # What the learner does by itself is to doubt.
    doubted = advice.gains(rows, labels=20, advice="doubt")
    assert {**doubted, "advice": "action"} == action
    wrong = {name: advice.gains(rows, labels=20, advice=name, wrong=0.5) for name in advice.FORMS}
    own = np.subtract(wrong["mask"]["success_mdp"], told["none"]["success_mdp"])
    assert wrong["mask"]["gain"]["success_mdp"][0] == pytest.approx(own.mean())
    assert wrong["thesis"]["success_mdp"] != wrong["mask"]["success_mdp"]


def shortly(monkeypatch):
    asking = {name: short(learner) for name, learner in questions.ASKING.items()}
    monkeypatch.setattr(questions, "ASKING", asking)
    questions.begun.cache_clear()


@pytest.mark.parametrize(
    ("learner", "strategies"),
    [("likelihood", ("random", "vote_entropy", "visited_and_diverse")), ("default", ("random",))],
)
def test_strategies_that_share_a_first_training_come_to_the_same_as_alone(
    monkeypatch, learner, strategies, teacher
):
    shortly(monkeypatch)
    shared = [questions.asked(FOLDER, 20, 40, (learner, 0, each)) for each in strategies]
    way = questions.ASKING[learner].with_learning(demonstrations=20, least_purity=1.0)
    for row in shared:
        lesson = Lesson.begin(teacher, way, 0)
        alone = lesson.row(lesson.learn(40, row["strategy"]))
        assert {name: row[name] for name in alone} == alone
        assert row["before"]["success"] == lesson.curve[0].success


def test_questions_are_compared_with_random_ones_seed_by_seed(monkeypatch):
    shortly(monkeypatch)
    jobs = [("likelihood", seed, s) for seed in (0, 1) for s in ("random", "margin")]
    rows = [questions.asked(FOLDER, 20, 50, job) for job in jobs]
    assert all(row["labels"] == 50 for row in rows)
    before = [row["before"] for row in rows]
    assert before[0] == before[1] != before[2]
    chance, margin = (questions.compared(rows, "likelihood", s) for s in ("random", "margin"))
    assert chance["against_random"]["success_mdp"] == [0, 0, 0]
    own = [row["accuracy_optimal_all"] for row in rows]
    gain = (own[1] - own[0] + own[3] - own[2]) / 2
    assert margin["against_random"]["accuracy_optimal_all"][0] == pytest.approx(gain)


def test_the_ladder_leads_from_the_thesis_to_the_demo():
    rungs = list(ladder.ladder().values())
    assert rungs[0] == THESIS
    first, last = rungs[0].learning, rungs[-1].learning
    ours = OURS.learning
    assert (last.features, last.least_purity) == (ours.features, ours.least_purity)
    assert last.active.initial == ours.active.initial
    assert last.active.hidden == ours.active.hidden
    assert last.active.policy_update == ours.active.policy_update
    assert not rungs[-1].everything
    assert first.active.initial.iterations == 10_000


def test_rows_that_were_kept_are_not_done_again(tmp_path):
    output = Output(tmp_path, None)
    kept = KeptRows(output, {"task": "t"})
    kept.add({"job": ["a", 1], "outcome": 7})
    again = KeptRows(output, {"task": "t"})
    jobs = [("a", 1), ("b", 2)]
    assert rows_of(jobs, partial(len), again, workers=1) == [7, 2]
    assert json.loads((tmp_path / KEPT).read_text())["rows"][-1]["outcome"] == 2
