import numpy as np
import pytest

from irl.errors import InputError
from irl.preferences import StatePreferences
from irl.problem import LearningProblem


def test_of_a_task_it_knows_all_but_the_goal(small_task):
    problem = LearningProblem.of(small_task, "thesis")
    assert problem.model is small_task.model
    assert problem.gamma == small_task.gamma
    assert problem.fixed_vr == small_task.fixed_vr
    assert problem.clusters is small_task.clusters
    assert (problem.preferences.preferred == small_task.preferred).all()
    assert (problem.start_states == small_task.start_states).all()
    np.testing.assert_array_equal(problem.required_features(), small_task.feature("thesis"))
    reachable = small_task.model.reachable(small_task.start_states)
    assert problem.candidates.tolist() == np.flatnonzero(reachable).tolist()
    assert not any("goal" in name for name in vars(problem))


def test_of_a_task_without_features_there_are_none(small_task):
    problem = LearningProblem.of(small_task)
    with pytest.raises(InputError, match="give some"):
        problem.required_features()
    with pytest.raises(InputError, match=r"no field 'magic'; valid: .*thesis"):
        LearningProblem.of(small_task, "magic")


def test_nothing_said_means_nothing_known(chain):
    problem = LearningProblem(chain, gamma=0.9)
    assert (problem.fixed_vr, problem.clusters, problem.candidates) == ({}, {}, None)
    assert not problem.preferences.preferred.size
    assert problem.start_states.tolist() == [0, 1, 2]  # in 3 nothing can be done


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_features_come_as_the_numbers_asked_for(chain, dtype):
    problem = LearningProblem(chain, [[0], [1], [2], [3]], gamma=0.9)
    features = problem.required_features(dtype)
    assert features.dtype == dtype
    assert features.tolist() == [[0.0], [1.0], [2.0], [3.0]]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"gamma": 1.0}, r"gamma: must lie in \[0, 1\), is 1.0"),
        ({"gamma": float("nan")}, "gamma"),
        (
            {"features": np.zeros(4)},
            r"features: numbers \[4, d\] wanted, or \[4, 2, d\] of pairs, got float64 \[4\]",
        ),
        ({"features": np.zeros((3, 2))}, r"features: .* got float64 \[3, 2\]"),
        ({"features": np.full((4, 1), np.nan)}, "features: must be finite"),
        ({"features": np.array([["a"]] * 4)}, "features: numbers"),
        ({"start_states": np.array([4])}, "start_states: must lie in 0…3, is 4"),
        ({"start_states": np.array([0.0])}, r"start_states: integers \[n\] wanted, got floats"),
        ({"candidates": np.array([-1])}, "candidates: must lie in 0…3, is -1"),
        ({"clusters": {"far": np.array([9])}}, "clusters: 'far': must lie in 0…3, is 9"),
        ({"fixed_vr": {7: 0.0}}, "fixed_vr: states: must lie in 0…3, is 7"),
        ({"preferences": StatePreferences([5])}, "preferences: preferred: must lie in 0…3, is 5"),
    ],
)
def test_a_field_that_does_not_fit_the_model_is_named(chain, fields, message):
    with pytest.raises(InputError, match=message):
        LearningProblem(chain, **({"gamma": 0.9} | fields))
