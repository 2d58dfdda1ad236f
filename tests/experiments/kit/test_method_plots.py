from matplotlib.figure import Figure

from experiments.kit.method_plots import NAMES, Panel, names_of, plot_methods
from irl.methods import METHODS


def test_every_method_has_a_name_of_its_own():
    assert NAMES.keys() == METHODS.keys()
    assert len(set(NAMES.values())) == len(NAMES)


def test_names_are_listed_as_a_sentence_does():
    assert names_of(["lp"]) == "LP (3.7)"
    assert names_of(["max_ent", "lp", "birl"]) == "MaxEnt, LP (3.7) and Bayesian IRL"


def test_a_method_without_preference_has_no_bar_and_says_so():
    figure = Figure()
    panel = Panel("a", "b", [0.5, None], 1.0, [(0.4, 0.6), (float("nan"),) * 2])
    plot_methods(figure, ["lp", "planning"], [panel], [1.0, 2.0], "A sentence.")
    figure.canvas.draw()
    assert [text.get_text() for text in figure.axes[0].texts] == ["0.50", "no preference"]
