import numpy as np
from pydrake.math import RotationMatrix

from experiments.bench import landings
from models.rotations import rotation_vector_to_matrix, rotation_z
from models.task.spaces import R_WO


def test_a_cube_tumbles_if_another_face_is_down():
    before = np.array([R_WO[0], R_WO[0], R_WO[0], R_WO[5], R_WO[5]])
    turns = [
        rotation_z(2.0),
        RotationMatrix.MakeXRotation(np.pi / 2).matrix(),
        RotationMatrix.MakeYRotation(np.pi).matrix(),
        rotation_vector_to_matrix([0.3, 0.2, 0.0]),
        RotationMatrix.MakeXRotation(-np.pi / 2).matrix(),
    ]
    after = np.array([turn @ R for turn, R in zip(turns, before, strict=True)])
    np.testing.assert_array_equal(landings.tumbled(before, after), [False, True, True, False, True])


class Peer:
    """Lets every cube lie as it was."""

    def run(self, script, **arrays):
        assert script == "mujoco_landing.py"
        assert arrays["R_WO"].shape == (landings.CUBES, 3, 3)
        return {"R_WO": arrays["R_WO"], "cpu_s": np.ones(landings.CUBES)}


def test_rows_count_who_tumbles_on_either_side(monkeypatch):
    monkeypatch.setattr(landings, "CUBES", 2)
    low, high = landings.rows(Peer(), seed=0)
    assert low.work.startswith("a fall of 30 mm") and high.work.startswith("a fall of 80 mm")
    for row in (low, high):
        assert (row.other_s, row.details["tumbled"]["mujoco"]) == (1.0, 0)
        assert 0 <= row.details["tumbled"]["ours"] <= 2
        assert len(row.details["interval"]["ours"]) == 2


def test_cubes_follow_the_seed_and_are_nearly_level():
    one, other = (landings.draw(0.6, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one.R_WO, other.R_WO)
    assert np.degrees(np.arccos(one.R_WO[:, 2, 2])).max() < 6.0
    assert ((one.restitution > 0.4) & (one.restitution < 0.6)).all()
