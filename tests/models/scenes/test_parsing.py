"""Every description file parses without a warning and is physically valid."""

import os
import subprocess
import sys

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex

from models.scenes.parsing import (
    DESCRIPTION,
    PACKAGE,
    add_models,
    description_hash,
    strict_parser,
)
from models.task.spaces import CUBE_EDGE

FILES = sorted(path.name for path in DESCRIPTION.iterdir())


@pytest.mark.parametrize("name", FILES)
def test_file_parses_strictly_and_its_inertias_are_valid(name):
    plant = MultibodyPlant(time_step=1e-3)
    add_models(plant, name)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for number in range(1, plant.num_bodies()):
        body = plant.get_body(BodyIndex(number))
        inertia = body.CalcSpatialInertiaInBodyFrame(context)
        assert inertia.IsPhysicallyValid(), body.name()


def test_package_uri_resolves_into_the_package():
    parser = strict_parser(MultibodyPlant(time_step=1e-3))
    assert parser.package_map().GetPath("active_advice_irl") == str(DESCRIPTION.parent)
    assert PACKAGE.startswith("package://active_advice_irl/")


def test_unknown_file_is_refused():
    with pytest.raises(RuntimeError, match=r"nothing\.urdf"):
        add_models(MultibodyPlant(time_step=1e-3), "nothing.urdf")


def test_the_cube_is_as_large_as_the_task_says():
    plant = MultibodyPlant(time_step=1e-3)
    scene_graph = SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    add_models(plant, "cube.sdf")
    (geometry,) = plant.GetCollisionGeometriesForBody(plant.GetBodyByName("cube"))
    size = scene_graph.model_inspector().GetShape(geometry).size()
    np.testing.assert_array_equal(size, [CUBE_EDGE] * 3)


def test_hash_names_the_files():
    assert len(description_hash()) == 64
    assert description_hash() == description_hash()


@pytest.mark.parametrize("name", ["gen3_2f85.dmd.yaml", "gen3_lite.dmd.yaml"])
def test_drakes_model_visualizer_opens_a_robot_by_its_uri(name):
    shown = subprocess.run(
        [
            *(sys.executable, "-m", "pydrake.visualization.model_visualizer", "--loop_once"),
            f"{PACKAGE}/{name}",
        ],
        env={**os.environ, "ROS_PACKAGE_PATH": str(DESCRIPTION.parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert shown.returncode == 0, shown.stderr
    assert "arning" not in shown.stderr
