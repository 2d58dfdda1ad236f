"""The API pages: what the docstrings say, to read in a browser from disk, the map of rooms first.

``make docs`` runs this. No page needs a network: style, search and text are in the folder.
"""

import ast
import pkgutil
import re
import textwrap
import types
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from unittest.mock import patch

from experiments.kit.command import Output, execute
from irl.errors import InputError
from irl.files import atomic_path

# As data flow: the robot and its task, its physics, learning, and the stories told of all three.
PACKAGES = ("models", "diagrams", "irl", "experiments")
# A script, which would run if it were imported.
TUTORIAL = "experiments.tutorial"
# A line of code, 100 characters at most, fits the page.
STYLE = "@media (min-width: 770px) { main.pdoc { width: calc(70rem + var(--sidebar-width)); } }"

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

* **To learn by doing**: `experiments.tutorial`, from a small grid to a learner that asks questions
  about a task of one's own.
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


def _source(name: str) -> str:
    spec = find_spec(name)
    assert spec is not None and spec.origin is not None
    return Path(spec.origin).read_text(encoding="utf-8")


def docstring(name: str) -> str:
    """A module's docstring, read without running the module; empty if it has none."""
    return ast.get_docstring(ast.parse(_source(name))) or ""


def rooms(package: str) -> list[str]:
    """What is directly in a package: first what its docstring names, in that order, then the rest.

    Args:
        package: its name; its docstring should name its rooms in backticks, in reading order.

    Returns:
        Dotted names of modules and packages.
    """
    spec = find_spec(package)
    assert spec is not None and spec.submodule_search_locations is not None
    text = docstring(package).replace(f"`{package}.", "`")
    found = {}
    for module in pkgutil.iter_modules(spec.submodule_search_locations):
        if not module.name.startswith("_"):
            found[module.name] = text.find(f"`{module.name}`")
    order = sorted(found, key=lambda name: (found[name] < 0, found[name], name))
    return [f"{package}.{name}" for name in order]


def modules_of(package: str) -> list[str]:
    """A package and all that is in it, in reading order."""
    names = [package]
    for room in rooms(package):
        spec = find_spec(room)
        inside = spec is not None and spec.submodule_search_locations is not None
        names += modules_of(room) if inside else [room]
    return names


def room_map(packages: Sequence[str] = PACKAGES) -> str:
    """The front page in Markdown: for each package a line, and a row for each of its rooms."""

    def row(name: str) -> str:
        return docstring(name).split("\n", maxsplit=1)[0].replace("|", "\\|")

    parts = [FRONT]
    for name in packages:
        parts += [f"\n## {name}\n", row(name), "\n| room | what it is for |\n|---|---|"]
        parts += [f"| `{room}` | {row(room)} |" for room in rooms(name)]
    return "\n".join(parts)


def lesson(script: str) -> str:
    """A script of ``# %%`` cells as Markdown: its text as text, its code as code."""
    parts = []
    for cell in re.split(r"^# %%", script, flags=re.MULTILINE)[1:]:
        kind, _, body = cell.partition("\n")
        if "markdown" in kind:
            parts.append(re.sub(r"^# ?", "", body, flags=re.MULTILINE).strip())
        else:
            parts.append(f"```python\n{body.strip()}\n```")
    return "\n\n".join(parts)


def literal_blocks(text: str) -> str:
    """What follows ``::`` in a docstring, indented, as a block of Markdown: drawings of ports."""

    def fence(found: re.Match[str]) -> str:
        lead = f"{found['lead']}:" if found["lead"] else ""
        return f"{lead}\n\n```text\n{textwrap.dedent(found['block']).strip(chr(10))}\n```\n\n"

    pattern = r"^(?P<lead>\S.*?)?::\n\n(?P<block>(?: +\S.*\n|\n)+)"
    return re.sub(pattern, fence, f"{text}\n", flags=re.MULTILINE)


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
        import jinja2  # noqa: PLC0415 - pdoc, an extra of developers, brings it
        import pdoc  # noqa: PLC0415
        import pdoc.doc  # noqa: PLC0415
        import pdoc.docstrings  # noqa: PLC0415
        import pdoc.render  # noqa: PLC0415
    except ImportError as error:
        raise InputError("docs: needs pdoc; install it with pip install '.[dev]'") from error
    pdoc.render.configure(docformat="google", footer_text="active-advice-irl")
    pages = pdoc.render.env
    assert pages.loader is not None
    pages.loader = jinja2.ChoiceLoader([jinja2.DictLoader({"custom.css": STYLE}), pages.loader])

    def document(name: str) -> pdoc.doc.Module:
        if name == TUTORIAL:
            return pdoc.doc.Module(types.ModuleType(name, lesson(_source(name))))
        module = pdoc.doc.Module.from_name(name)
        for handed_on in getattr(module.obj, "__all__", ()):
            # What loads on first use is not there for pdoc before.
            setattr(module.obj, handed_on, getattr(module.obj, handed_on))
        return module

    modules = {name: document(name) for package in packages for name in modules_of(package)}
    for name, module in modules.items():
        # By itself, pdoc imports what is inside, or lists what __all__ names and so no module.
        module.__dict__["submodules"] = [
            inner for other, inner in modules.items() if other.rpartition(".")[0] == name
        ]
    front = pdoc.doc.Module(types.ModuleType("active-advice-irl", room_map(packages)))
    convert = pdoc.docstrings.convert
    with patch.object(
        pdoc.docstrings, "convert", lambda text, *rest: convert(literal_blocks(text), *rest)
    ):
        for name, module in modules.items():
            path = folder / f"{name.replace('.', '/')}.html"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(pdoc.render.html_module(module, modules), encoding="utf-8")
        (folder / "search.js").write_text(pdoc.render.search_index(modules), encoding="utf-8")
        # Last: who finds it finds what it links to.
        with atomic_path(folder / "index.html") as path:
            path.write_text(pdoc.render.html_module(front, modules), encoding="utf-8")
    return len(modules)


def main(config: Config, output: Output) -> dict[str, Any]:
    """Build the pages; say where to open them."""
    pages = build(output.folder)
    print(f"{pages} pages: open {output.folder / 'index.html'} in a browser")
    return {"pages": pages}


if __name__ == "__main__":
    execute(Config, main)
