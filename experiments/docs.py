"""The API pages: what the docstrings say, to read in a browser from disk, the map of rooms first.

``make docs`` runs this. No page needs a network: style, search and text are in the folder.
"""

import inspect
import pkgutil
import types
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from experiments.kit.command import Output, execute
from irl.errors import InputError
from irl.files import atomic_path

# As data flow: the robot and its task, its physics, learning, and the stories told of all three.
PACKAGES = ("models", "diagrams", "irl", "experiments")
# Programs of another virtual environment, which import what is not installed here.
LEFT_OUT = ("experiments.bench.peers",)

FRONT = """
Teach a robot arm to regrasp and place a cube, from a few demonstrations and pieces of advice.
`README.md` beside the code says what the method is, how to install it and what it reaches; these
pages say what each module is for and what its functions take and give back.

```text
models ──► diagrams ──► task data ──► irl ──► policy ──► diagrams
                            └── experiments tell each story
```

Four packages, in the order in which data flows. A folder is a room; within a package, rooms stand
in reading order, so that a room uses the ones before it. The learning library `irl` can be read by
itself: it knows no robot.

## Where to begin

* **To learn by doing**: `experiments.tutorial`, from a small grid to a task of one's own.
* **To use the learning library**: `irl`, then `irl.methods` (every method, called alike) and
  `irl.active` (Algorithm 4.1 of the thesis).
* **To bring a task of one's own**: `experiments.own_task`, a worked example.
* **To use the robot in Drake**: `models`, then `diagrams.station`, the arm, gripper and cube as one
  system with named ports.
* **To run trials on many machines**: `experiments.transitions`.
"""


@dataclass(frozen=True)
class Config:
    """Build the API pages from the docstrings: open index.html in the folder, no server needed."""

    out: Path = Path("out/docs")
    """Folder of the pages."""


def first_line(documented: types.ModuleType) -> str:
    """The first line of a module's docstring, as a cell of a table."""
    return (inspect.getdoc(documented) or "").split("\n", maxsplit=1)[0].replace("|", "\\|")


def rooms(package: types.ModuleType) -> list[types.ModuleType]:
    """What is directly in a package: first what its docstring names, in that order, then the rest.

    Args:
        package: imported; its docstring should name its rooms in backticks, in reading order.
    """
    text = inspect.getdoc(package) or ""
    found = {}
    for module in pkgutil.iter_modules(package.__path__):
        if not module.name.startswith("_"):
            found[module.name] = text.find(f"`{module.name}`")
    order = sorted(found, key=lambda name: (found[name] < 0, found[name], name))
    return [import_module(f"{package.__name__}.{name}") for name in order]


def room_map(packages: Sequence[str] = PACKAGES) -> str:
    """The front page in Markdown: for each package a line, and a row for each of its rooms."""
    parts = [FRONT]
    for name in packages:
        package = import_module(name)
        parts += [f"\n## {name}\n", first_line(package), "\n| room | what it is for |\n|---|---|"]
        parts += [f"| `{room.__name__}` | {first_line(room)} |" for room in rooms(package)]
    return "\n".join(parts)


def build(folder: Path, packages: Sequence[str] = PACKAGES) -> int:
    """Write a page for each module, the search index and the front page ``index.html``.

    Args:
        folder: where to; made if it is not there.
        packages: names of what to describe, with all that is in them.

    Returns:
        The number of modules.

    Raises:
        InputError: if pdoc is not installed.
    """
    try:
        import pdoc  # noqa: PLC0415  (of the extra dev alone)
        import pdoc.doc  # noqa: PLC0415
        import pdoc.render  # noqa: PLC0415
    except ImportError as error:
        raise InputError("docs: needs pdoc; install it with pip install '.[dev]'") from error
    pdoc.render.configure(docformat="google", footer_text="active-advice-irl")
    wanted = [*packages, *(f"!{name}" for name in LEFT_OUT)]
    pdoc.pdoc(*wanted, output_directory=folder)
    modules = {name: pdoc.doc.Module.from_name(name) for name in pdoc.extract.walk_specs(wanted)}
    front = types.ModuleType("active-advice-irl", room_map(packages))
    # Written last: a reader who finds it finds what it links to.
    with atomic_path(folder / "index.html") as path:
        path.write_text(pdoc.render.html_module(pdoc.doc.Module(front), modules), encoding="utf-8")
    return len(modules)


def main(config: Config, output: Output) -> dict[str, Any]:
    """Build the pages; say where to open them."""
    pages = build(output.folder)
    print(f"{pages} pages: open {output.folder / 'index.html'} in a browser")
    return {"pages": pages}


if __name__ == "__main__":
    execute(Config, main)
