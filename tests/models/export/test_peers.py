"""What other programs read from the exported files: the same robot.

pinocchio, yourdfpy and MuJoCo live in the peers' environment, which ``make bench`` builds: with
what they bring they are over 500 MB.
"""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from experiments.bench.comparison import Peers

from .conftest import CLOSE, POSTURES

READERS = ("pinocchio", "yourdfpy", "mujoco")
READER = Path(__file__).with_name("reader.py")
"""What the peers run."""


def missing():
    """The readers that the peers' environment lacks, or what it lacks itself."""
    if not Peers().python.exists():
        return "the peers' environment (make bench)"
    code = f"from importlib.util import find_spec as f; print(*[n for n in {READERS} if not f(n)])"
    done = subprocess.run([Peers().python, "-c", code], capture_output=True, text=True, check=True)
    return ", ".join(done.stdout.split())


MISSING = missing()
pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {MISSING}")


@pytest.fixture(scope="module")
def theirs(sample):
    urdf, srdf, mjcf = map(str, sample.files)
    return Peers().run(
        str(READER),
        urdf=np.array(urdf),
        srdf=np.array(srdf),
        mjcf=np.array(mjcf),
        joints=np.array(sample.joints),
        frames=np.array(sample.frames),
        positions=sample.positions,
    )


@pytest.mark.parametrize("reader", READERS)
def test_every_link_is_where_it_is(sample, theirs, reader):
    X = theirs[f"{reader}_X"]
    np.testing.assert_allclose(X, sample.X[: len(X)], rtol=0, atol=1e-9)


@pytest.mark.parametrize("reader", ["pinocchio", "mujoco"])
def test_collisions_are_the_same(sample, theirs, reader):
    same = theirs[f"{reader}_collides"] == (sample.distance < 0)
    assert same[:POSTURES].mean() >= 0.99
    assert same[POSTURES:].mean() >= 0.99  # where shapes touch, or nearly
    assert (sample.distance[POSTURES:] < 0).sum() == CLOSE


@pytest.mark.parametrize("reader", ["yourdfpy", "mujoco"])
def test_masses_are_the_same(sample, theirs, reader):
    np.testing.assert_allclose(theirs[f"{reader}_mass"], sample.mass, rtol=1e-12)


@pytest.mark.parametrize("reader", ["pinocchio", "mujoco"])
def test_inertias_and_centres_of_mass_are_the_same(sample, theirs, reader):
    wanted = sample.mass_matrix
    np.testing.assert_allclose(theirs[f"{reader}_mass_matrix"], wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("reader", READERS)
def test_no_shape_is_dropped(sample, theirs, reader):
    shapes = theirs[f"{reader}_shapes"]
    if reader == "mujoco":
        np.testing.assert_array_equal(shapes, sample.shapes)
    else:  # three for a capsule
        assert ((shapes == sample.shapes) | (shapes == 3 * sample.shapes)).all()


def test_couplers_hold_in_mujoco(theirs):
    assert theirs["mujoco_slack"] < 0.02


def test_named_postures_are_read(sample, theirs):
    assert {"home", "retract", "vertical"} <= set(theirs["pinocchio_postures"].tolist())
