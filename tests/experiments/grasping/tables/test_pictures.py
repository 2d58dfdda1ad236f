"""Pictures of the tables: what is drawn is what was measured."""

import numpy as np
from matplotlib.figure import Figure

from experiments.grasping.tables.pictures import draw_gains

GAINS = {"random": [0.0, 0.0, 0.0], "margin": [0.05, 0.02, 0.07]}


def test_gains_are_drawn_in_points_learner_by_learner_with_their_intervals():
    rows = [
        {
            "learner": learner,
            "strategy": strategy,
            "against_random": {
                "accuracy_optimal_all": gain,
                "success_mdp": [-value for value in gain[:1]] + [-gain[2], -gain[1]],
            },
        }
        for learner in ("likelihood", "default")
        for strategy, gain in GAINS.items()
    ]
    figure = Figure()
    draw_gains(figure, rows)
    better, reached = figure.axes
    assert [text.get_text() for text in better.get_yticklabels()] == ["random", "margin"]
    for axis, sign in ((better, 1), (reached, -1)):
        for container in axis.containers:
            np.testing.assert_allclose(container.lines[0].get_xdata(), [0, sign * 5])
            ends = sorted(cap.get_xdata()[1] for cap in container.lines[1])
            np.testing.assert_allclose(ends, sorted([sign * 2, sign * 7]))
    assert [text.get_text() for text in reached.legend_.get_texts()] == ["likelihood", "default"]
