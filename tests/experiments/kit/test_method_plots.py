from experiments.kit.method_plots import NAMES, names_of
from irl.methods import METHODS


def test_every_method_has_a_name_of_its_own():
    assert NAMES.keys() == METHODS.keys()
    assert len(set(NAMES.values())) == len(NAMES)


def test_names_are_listed_as_a_sentence_does():
    assert names_of(["lp"]) == "LP (3.7)"
    assert names_of(["max_ent", "lp", "birl"]) == "MaxEnt, LP (3.7) and Bayesian IRL"
