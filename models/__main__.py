"""Open a robot in Drake's model visualizer, or write it as URDF, SRDF and MJCF, from any folder."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from pydrake.visualization import ModelVisualizer

from models.errors import ModelError
from models.export.files import export_robot
from models.scenes.parsing import MODELS, PACKAGE

SCENES = {
    ("gen3", False): "station.dmd.yaml",
    ("gen3", True): "gen3_2f85.dmd.yaml",
    ("gen3_lite", False): "gen3_lite_station.dmd.yaml",
    ("gen3_lite", True): "gen3_lite.dmd.yaml",
}
"""Description file of each robot, before the table or alone."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Show a robot until the page's button "Stop Running" is pressed, or export it."""
    parser = argparse.ArgumentParser(prog="python -m models", description=__doc__)
    parser.add_argument(
        "robot",
        nargs="?",
        default="gen3",
        choices=["gen3", "gen3_lite"],
        help="which robot to show (default: %(default)s)",
    )
    parser.add_argument(
        "--alone", action="store_true", help="show arm and hand without box, table and cube"
    )
    parser.add_argument(
        "--export",
        type=Path,
        metavar="DIR",
        help="write arm and gripper as URDF, SRDF and MJCF into a folder, and show nothing",
    )
    parser.add_argument("--browser", action="store_true", help="open the page in a browser window")
    parser.add_argument(
        "--loop-once", action="store_true", help="end after the first picture, for tests"
    )
    chosen = parser.parse_args(arguments)
    if chosen.export is not None:
        try:
            files = export_robot(chosen.export, chosen.robot)
        except ModelError as error:
            parser.error(f"--export {error}")
        print(*files, sep="\n")
        return
    visualizer = ModelVisualizer(browser_new=chosen.browser)
    visualizer.package_map().AddPackageXml(str(MODELS / "package.xml"))
    visualizer.AddModels(url=f"{PACKAGE}/{SCENES[chosen.robot, chosen.alone]}")
    visualizer.Run(loop_once=chosen.loop_once)


if __name__ == "__main__":
    main()
