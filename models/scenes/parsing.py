"""Plants from the model files: parsing, strict, by ``package://active_advice_irl`` URIs."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from models.errors import ModelError

MODELS = Path(__file__).parents[1]
DESCRIPTION = MODELS / "description"
PACKAGE = "package://active_advice_irl/description"

ARM, GRIPPER, CUBE = "arm", "gripper", "cube"
"""Model instance names in every scene."""
TOOL = "tool"
"""Model instance name of a tool that is a single shape."""


def strict_parser(plant: MultibodyPlant) -> Parser:
    """Return a parser that knows this package and turns every warning into an error."""
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.package_map().AddPackageXml(str(MODELS / "package.xml"))
    return parser


def add_models(plant: MultibodyPlant, *files: str) -> None:
    """Add description files, e.g. ``station.dmd.yaml``, to a plant before `Finalize`.

    Args:
        plant: what they are added to.
        files: names in `DESCRIPTION`, absolute paths, or ``package://active_advice_irl/…``.

    Raises:
        RuntimeError: if a file is missing, or Drake would warn about it.
    """
    parser = strict_parser(plant)
    for file in files:
        parser.AddModels(url=url_of(file, own=True))


def url_of(file: str, *, own: bool = False) -> str:
    """The URL of a file: as it is, of an absolute path, or if ``own`` of a name in `DESCRIPTION`.

    Raises:
        ModelError: if it is none of these.
    """
    file = str(file)
    if "://" in file:
        return file
    if Path(file).is_absolute():
        return Path(file).as_uri()
    if own:
        return f"{PACKAGE}/{file}"
    raise ModelError(f"{file!r}; valid: an absolute path, or package://NAME/…")


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
