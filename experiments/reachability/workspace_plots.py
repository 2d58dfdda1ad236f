"""Pictures of the workspace map: slices as PNG, and voxels about the robot in Meshcat."""

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle
from pydrake.geometry import Meshcat, MeshcatParams, MeshcatVisualizer
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.perception import BaseField, Fields, PointCloud
from pydrake.systems.framework import DiagramBuilder

from models.maps.workspace_map import WorkspaceMap
from models.scenes.parsing import ARM, add_models
from models.scenes.planning_scene import HOME

COLOURS = "viridis"
TITLE = "Workspace map"
SLICES = 5
CAMERA, FOCUS = (1.35, -1.15, 1.25), (0.4, 0.0, 0.55)
"""Where the page's viewer stands and looks at first, in the world [m]."""
_BOX, _TABLE, _TOP = (-0.12, 0.12), (0.35, 0.75), 0.5  # furniture along x, and its height [m]
_BOX_Y, _TABLE_Y = (-0.12, 0.12), (-0.2, 0.2)


def plot_slices(figure: Figure, the_map: WorkspaceMap) -> None:
    """Share of the orientations that are reached: level slices above, upright ones below."""
    x, y, z = the_map.grid.axes()
    levels, uprights = _spread(len(z)), _spread(len(y))
    columns = max(len(levels), len(uprights))
    figure.set_size_inches(14, 5.4)
    axes = figure.subplots(2, columns, squeeze=False)
    for axis in axes.ravel():
        axis.set_visible(False)
    for axis, k in zip(axes[0], levels, strict=False):
        image = _slice(axis, x, y, the_map.share[:, :, k], f"z = {z[k]:.3f} m")
        axis.set_ylabel("y [m]" if k == levels[0] else "")
        for (left, right), (low, high) in ((_BOX, _BOX_Y), (_TABLE, _TABLE_Y)):
            axis.add_patch(
                Rectangle((left, low), right - left, high - low, fill=False, ec="white", lw=1)
            )
    for axis, j in zip(axes[1], uprights, strict=False):
        image = _slice(axis, x, z, the_map.share[:, j, :], f"y = {y[j]:.3f} m")
        axis.set_ylabel("z [m]" if j == uprights[0] else "")
        if _TABLE_Y[0] <= y[j] <= _TABLE_Y[1]:
            axis.plot(_TABLE, (_TOP, _TOP), color="white", lw=2)
    figure.suptitle(
        "Share of the 18 gripper orientations in which the tool centre point is reached"
    )
    figure.supxlabel("x [m]  (table outlined in white)", fontsize=10)
    figure.colorbar(image, ax=axes, label="share of orientations", shrink=0.8)


def _spread(count: int) -> list[int]:
    return sorted(set(np.linspace(0, count - 1, SLICES).round().astype(int).tolist()))


def _slice(axis: Axes, x: np.ndarray, y: np.ndarray, share: np.ndarray, title: str) -> AxesImage:
    axis.set_visible(True)
    # A voxel reaches half a spacing to either side of its centre.
    half = 0.5 * (x[1] - x[0] if len(x) > 1 else 0.025)
    extent = (x[0] - half, x[-1] + half, y[0] - half, y[-1] + half)
    image = axis.imshow(
        share.T, cmap=COLOURS, vmin=0.0, vmax=1.0, origin="lower", extent=extent, aspect="equal"
    )
    axis.set_title(title, fontsize=10)
    axis.autoscale(False)
    return image


def write_scene(the_map: WorkspaceMap, path: Path) -> None:
    """The robot at home among points coloured by the share of orientations, as one HTML page.

    Args:
        the_map: what to show; voxels that no orientation reaches are left out.
        path: page to write.
    """
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    add_models(plant, "station.dmd.yaml")
    plant.Finalize()
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant.SetPositions(plant.GetMyContextFromRoot(context), plant.GetModelInstanceByName(ARM), HOME)
    diagram.ForcedPublish(context)

    share = the_map.share
    voxels = np.argwhere(share > 0.0)
    cloud = PointCloud(len(voxels), Fields(BaseField.kXYZs | BaseField.kRGBs))
    points = [axis[i] for axis, i in zip(the_map.grid.axes(), voxels.T, strict=True)]
    cloud.mutable_xyzs()[:] = np.array(points, dtype=np.float32)
    colours = colormaps[COLOURS](share[tuple(voxels.T)])[:, :3]
    # The page takes colours of points for linear light.
    cloud.mutable_rgbs()[:] = np.round(255 * colours**2.2).T.astype(np.uint8)
    # Small enough to see the robot between them.
    meshcat.SetObject("reachable", cloud, point_size=0.35 * the_map.grid.spacing)
    meshcat.SetCameraPose(CAMERA, FOCUS)
    page = meshcat.StaticHtml().replace("<title>Drake MeshCat</title>", f"<title>{TITLE}</title>")
    path.write_text(page.replace("</body>", _legend() + "</body>"), encoding="utf-8")


def _legend() -> str:
    """The colours' meaning, as HTML in a corner of the page."""
    stops = [to_hex(colour) for colour in colormaps[COLOURS](np.linspace(0.0, 1.0, 9))]
    return f"""
<div style="position: fixed; left: 16px; bottom: 16px; width: 320px; padding: 10px 14px;
            font: 14px sans-serif; color: black; background: rgba(255, 255, 255, 0.85)">
  {TITLE}: share of the 18 gripper orientations in which the tool centre point is reached,
  free of collisions. Places out of reach are left out.
  <div style="height: 14px; margin-top: 8px;
              background: linear-gradient(to right, {", ".join(stops)})"></div>
  <div style="display: flex; justify-content: space-between">
    <span>0&#8239;%</span><span>50&#8239;%</span><span>100&#8239;%</span>
  </div>
</div>
"""
