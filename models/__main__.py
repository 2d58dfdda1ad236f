"""Open a robot in Drake's model visualizer, from any folder: ``python -m models``."""

import argparse
from collections.abc import Sequence

from pydrake.visualization import ModelVisualizer

from models.scenes.parsing import MODELS, PACKAGE

SCENES = {
    ("gen3", False): "station.dmd.yaml",
    ("gen3", True): "gen3_2f85.dmd.yaml",
    ("gen3_lite", False): "gen3_lite_station.dmd.yaml",
    ("gen3_lite", True): "gen3_lite.dmd.yaml",
}
"""Description file of each robot, before the table or alone."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Show a robot until the page's button "Stop Running" is pressed."""
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
    parser.add_argument("--browser", action="store_true", help="open the page in a browser window")
    parser.add_argument(
        "--loop-once", action="store_true", help="end after the first picture, for tests"
    )
    chosen = parser.parse_args(arguments)
    visualizer = ModelVisualizer(browser_new=chosen.browser)
    visualizer.package_map().AddPackageXml(str(MODELS / "package.xml"))
    visualizer.AddModels(url=f"{PACKAGE}/{SCENES[chosen.robot, chosen.alone]}")
    visualizer.Run(loop_once=chosen.loop_once)


if __name__ == "__main__":
    main()
