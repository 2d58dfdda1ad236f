import json

import pytest

from experiments.grasping.learning import CurvePoint, _read_curve
from irl.errors import InputError

POINT = {"query": 0, "demonstrated": 60, "success": 0.5, "accuracy_optimal_all": 1.0}


def written(path, points):
    path.write_text(json.dumps({"points": points}))
    return path


def test_a_curve_comes_back(tmp_path):
    path = written(tmp_path / "curve.json", [POINT, POINT | {"query": 2}])
    assert _read_curve(path) == [CurvePoint(0, 60, 0.5, 1.0), CurvePoint(2, 60, 0.5, 1.0)]


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (5, "'points' must be a list"),
        ([5], "point 0: must have the fields"),
        ([POINT | {"mood": 1}], "point 0: must have the fields"),
        ([{"query": 0}], "point 0: must have the fields"),
        ([POINT | {"success": 1.5}], "point 0: field 'success' is 1.5"),
        ([POINT | {"success": "x"}], "point 0: field 'success' is 'x'"),
        ([POINT | {"query": True}], "point 0: field 'query' is True"),
        ([POINT | {"demonstrated": 0}], "point 0: field 'demonstrated' is 0"),
        ([POINT, POINT], "point 1: field 'query' must grow"),
    ],
)
def test_a_damaged_curve_is_refused_by_point_and_field(tmp_path, points, told):
    path = written(tmp_path / "curve.json", points)
    with pytest.raises(InputError) as caught:
        _read_curve(path)
    assert told in str(caught.value)
    assert str(path) in str(caught.value) and "delete the file" in str(caught.value)


def test_a_curve_that_is_no_object_is_refused(tmp_path):
    path = tmp_path / "curve.json"
    path.write_text("[1]")
    with pytest.raises(InputError, match="'points' must be a list"):
        _read_curve(path)
