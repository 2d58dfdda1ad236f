"""The picture of lessons shows each once, where it was over."""

from matplotlib.figure import Figure

from experiments.grasping.hidden.pictures import draw_lessons

LATER = {"labels": 9, "accuracy_optimal_all": 0.7}
ROWS = [
    {"stopped": True, "labels": 20, "accuracy_optimal_all": 0.99, "simple": {}},
    {"stopped": True, "labels": 22, "accuracy_optimal_all": 0.95, "simple": {}},
    {
        "stopped": False,
        "labels": 40,
        "accuracy_optimal_all": 0.6,
        "simple": {"labels agree": LATER, "fixed number": LATER},
    },
]


def test_each_lesson_is_where_it_was_over_and_each_rule_where_it_would_have_ended():
    figure = Figure()
    draw_lessons(figure, ROWS, 0.9)
    (axis,) = figure.axes
    ended, going, agree, unchanged = (each.get_offsets().tolist() for each in axis.collections)
    assert ended == [[20, 0.99], [22, 0.95]]
    assert going == [[40, 0.6]]
    assert agree == [[9, 0.7]]
    assert unchanged == []
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [label[-3:] for label in labels] == ["(2)", "(1)", "(1)", "(0)"]
