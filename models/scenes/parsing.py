"""Plants from the model files: parsing, strict, by ``package://active_advice_irl`` URIs."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

MODELS = Path(__file__).parents[1]
DESCRIPTION = MODELS / "description"
PACKAGE = "package://active_advice_irl/description"

ARM, GRIPPER, CUBE = "arm", "gripper", "cube"
"""Model instance names in every scene."""


def strict_parser(plant: MultibodyPlant) -> Parser:
    """Return a parser that knows this package and turns every warning into an error."""
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.package_map().AddPackageXml(str(MODELS / "package.xml"))
    return parser


def add_models(plant: MultibodyPlant, *files: str) -> None:
    """Add description files, e.g. ``station.dmd.yaml``, to a plant before `Finalize`.

    Raises:
        RuntimeError: if a file is missing, or Drake would warn about it.
    """
    parser = strict_parser(plant)
    for file in files:
        parser.AddModels(url=f"{PACKAGE}/{file}")


STATION_FILES = (
    "box.sdf",
    "cube.sdf",
    "furniture.dmd.yaml",
    "gen3.urdf",
    "gen3_2f85.dmd.yaml",
    "robotiq_2f_85.urdf",
    "station.dmd.yaml",
    "table.sdf",
)
"""What a station consists of."""


def description_hash(files: Iterable[str] = STATION_FILES) -> str:
    """SHA-256 over description files: names what stored results were computed from."""
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(name.encode() + b"\0" + (DESCRIPTION / name).read_bytes() + b"\0")
    return digest.hexdigest()
