"""Still pictures of the station, rendered off screen."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    LightParameter,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from diagrams.hand_mount import HandMount
from models.scenes.parsing import CUBE

VIEW_FROM, VIEW_AT = (1.35, -1.05, 1.15), (0.38, 0.0, 0.68)
"""Where the standard view stands and looks [m]."""


class StillCamera:
    """Renders the station's models at given plant positions, nothing simulated."""

    def __init__(
        self,
        *,
        size: tuple[int, int] = (640, 480),
        view_from: tuple[float, float, float] = VIEW_FROM,
        view_at: tuple[float, float, float] = VIEW_AT,
        field_of_view: float = 0.75,
        prepare: Callable[[MultibodyPlant], None] | None = None,
    ) -> None:
        """Set the camera up.

        Args:
            size: width and height in pixels.
            view_from: where it stands, world [m].
            view_at: where it looks, world [m].
            field_of_view: vertical, radians.
            prepare: what changed the station's plant, if anything did.
        """
        builder = DiagramBuilder()
        self._plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        HandMount(self._plant)
        if prepare is not None:
            prepare(self._plant)
        self._plant.Finalize()
        # One lamp beside the camera and one high on the other side, so that faces differ.
        lamps = [
            LightParameter(type="directional", direction=[0.2, 0.3, 1.0], intensity=0.9),
            LightParameter(
                type="directional", frame="world", direction=[-0.3, -0.5, -1.0], intensity=0.7
            ),
        ]
        parameters = RenderEngineVtkParams(default_clear_color=[0.96, 0.97, 0.98], lights=lamps)
        scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(parameters))
        core = RenderCameraCore(
            "vtk", CameraInfo(*size, field_of_view), ClippingRange(0.05, 6.0), RigidTransform()
        )
        self._sensor = sensor = builder.AddSystem(
            RgbdSensor(
                scene_graph.world_frame_id(),
                _look(np.array(view_from), np.array(view_at)),
                ColorRenderCamera(core, False),
                DepthRenderCamera(core, DepthRange(0.1, 5.0)),
            )
        )
        builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
        builder.ExportOutput(sensor.color_image_output_port(), "image")
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self._context = self._plant.GetMyMutableContextFromRoot(self._root)

    def look(self, view_from: ArrayLike, view_at: ArrayLike) -> None:
        """Stand at one point ``[3]`` and look at another ``[3]``, world [m]."""
        X_WC = _look(np.asarray(view_from, dtype=float), np.asarray(view_at, dtype=float))
        self._sensor.SetX_PB(self._sensor.GetMyMutableContextFromRoot(self._root), X_WC)

    def cube(self, positions: np.ndarray) -> np.ndarray:
        """The cube's centre ``[3]`` [m] at ``positions [n_q]``."""
        self._plant.SetPositions(self._context, positions)
        return self._plant.GetBodyByName(CUBE).EvalPoseInWorld(self._context).translation().copy()

    def picture(self, positions: np.ndarray) -> np.ndarray:
        """Render the plant at ``positions [n_q]`` (the station's order); uint8 ``[h, w, 3]``."""
        self._plant.SetPositions(self._context, positions)
        image = self._diagram.GetOutputPort("image").Eval(self._root)
        return np.array(image.data[..., :3])


def _look(p_from: np.ndarray, p_at: np.ndarray) -> RigidTransform:
    """X_WC of a camera (x right, y down, z ahead) that looks from one point at another."""
    ahead = (p_at - p_from) / np.linalg.norm(p_at - p_from)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R_WC = RotationMatrix(np.column_stack([right, np.cross(ahead, right), ahead]))
    return RigidTransform(R_WC, p_from)
