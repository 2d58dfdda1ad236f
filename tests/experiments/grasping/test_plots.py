"""Pictures of learning say in words what was advised, and mark what is not optimal in black."""

from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure

from experiments.grasping.learning import CurvePoint
from experiments.grasping.plots import COLOURS, plot_learning, plot_policy
from irl.active_state import QueryRecord
from models.task.spaces import GOAL_STATE, N_FREE


def texts(figure):
    return {text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text"))}


def learnt(clusters):
    history = [QueryRecord(0, name, 100 + k, 1.0) for k, name in enumerate(clusters)]
    curve = [CurvePoint(k, 100 + k, 0.5, 0.4) for k in range(len(clusters) + 1)]
    return SimpleNamespace(result=SimpleNamespace(history=history), curve=curve)


ASSESSMENT = SimpleNamespace(success_mdp_oracle=1.0)


def test_the_advised_clusters_are_told_in_words():
    figure = Figure()
    plot_learning(
        figure, learnt(["gripper_down", None, "grasped ∩ upper_limit", "odd"]), ASSESSMENT
    )
    assert {"held from above", "the hand holds the cube, and upper layer", "odd"} <= texts(figure)
    marks = [line.get_xdata().tolist() for line in figure.axes[1].get_lines()]
    # Four answers, each about a state; but for the second, about a cluster besides.
    assert marks == [[1], [1], [2], [3], [3], [4], [4]]
    rows = [line.get_ydata().tolist() for line in figure.axes[1].get_lines()]
    assert rows == [[0], [1], [0], [0], [2], [0], [3]]
    assert figure.axes[1].get_xlabel() == "answers"


def test_without_questions_there_is_the_curve_alone():
    figure = Figure()
    plot_learning(figure, learnt([]), ASSESSMENT)
    assert len(figure.axes) == 1


def test_answers_about_states_are_marked_without_advice_too():
    figure = Figure()
    plot_learning(figure, learnt([None, None]), ASSESSMENT)
    assert [line.get_xdata().tolist() for line in figure.axes[1].get_lines()] == [[1], [2]]
    assert "what to do in a state" in texts(figure)


def test_grasps_that_are_not_optimal_are_crossed_and_the_goal_is_starred():
    figure = Figure()
    action = np.zeros(N_FREE, dtype=int)
    optimal = np.zeros((N_FREE, 55), dtype=bool)
    optimal[:, 0] = True
    optimal[[7, 50], 0] = False
    plot_policy(
        figure,
        SimpleNamespace(goal_states=np.array([GOAL_STATE])),
        SimpleNamespace(action=action),
        SimpleNamespace(optimal_actions=optimal),
    )
    crosses, star = (figure.axes[0].get_lines()[k].get_xydata().tolist() for k in (0, 1))
    assert crosses == [[7, 0], [2, 1]]
    assert star == [[GOAL_STATE % 48, GOAL_STATE // 48]]
    assert {"yellow face up", "red to the front", "hand level, front"} <= texts(figure)


def test_no_colour_of_a_grasp_is_red():
    assert len(COLOURS) == 18
    for red, green, blue in COLOURS:
        assert not (red > 0.7 and max(green, blue) < 0.2)
