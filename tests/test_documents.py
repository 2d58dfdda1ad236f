"""What the documents name is there: files, commands, versions."""

import contextlib
import re
import tomllib
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import irl

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted(
    path
    for folder in (ROOT, *(ROOT / name for name in ("irl", "models", "diagrams", "experiments")))
    for path in (folder.glob("*.md") if folder == ROOT else folder.rglob("*.md"))
)
# By test_examples.py, test_station_page.py, test_scenarios_page.py and test_your_own_arm.py in the
# folders of `tests`.
RUN_HERE = {
    "README.md",
    "experiments/grasping.md",
    "experiments/own_data.md",
    "experiments/own_task.md",
    "diagrams/scenarios.md",
    "diagrams/station.md",
    "models/your_own_arm.md",
}


def commands() -> set[str]:
    """Names that ``python -m experiments.NAME`` runs."""
    folder = ROOT / "experiments"
    scripts = {p.stem for p in folder.glob("[a-z]*.py")}
    return scripts | {p.parent.name for p in folder.glob("*/__main__.py")}


def ids(path: Path) -> str:
    return str(path.relative_to(ROOT))


def anchors(text: str) -> set[str]:
    """What GitHub calls the headings."""
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith(("http://", "https://")):
            continue
        file, _, anchor = target.partition("#")
        if file:
            assert (page.parent / file).exists(), target
        else:
            assert anchor in anchors(text), target


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_named_paths_exist(page):
    for name in re.findall(
        r"`((?:experiments|tests|models|diagrams|irl)/[\w./-]+)`", page.read_text(encoding="utf-8")
    ):
        assert (ROOT / name).exists(), name


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_commands_exist(page):
    text = page.read_text(encoding="utf-8")
    for module in re.findall(r"python -m (experiments\.\w+|models|diagrams)\b", text):
        name = module.removeprefix("experiments.")
        if name == "NAME":
            continue
        assert name in commands() or find_spec(f"{module}.__main__"), module


def test_the_table_of_commands_is_complete():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (table,) = re.findall(
        r"^\| command \| story \|\n\|---\|---\|\n((?:\|.+\n)+)", text, re.MULTILINE
    )
    firsts = [row.split("|")[1] for row in table.splitlines()]
    named = {name for cell in firsts for name in re.findall(r"`(\w+)", cell)}
    assert commands() - {"tutorial", "docs"} <= named
    subcommands = {"status", "export", "rules", "releases", "enough", "make", "planning"}
    subcommands |= {"ladder", "questions", "advice", "clusters", "network", "model_free", "larger"}
    assert named - subcommands <= commands()


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_python_in_pages_is_run(page):
    if re.search(r"^```python$", page.read_text(encoding="utf-8"), re.MULTILINE):
        assert ids(page) in RUN_HERE


def exists(name: str) -> bool:
    """Whether there is a module of that dotted name, or something of that name in a module."""
    module, _, last = name.rpartition(".")
    with contextlib.suppress(ModuleNotFoundError):
        if find_spec(name) is not None:
            return True
    return hasattr(import_module(module), last) if module else False


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_modules_that_prose_names_exist(page):
    text = page.read_text(encoding="utf-8")
    if page.name == "CHANGELOG.md":  # the table names what was, and after it what is
        names = re.findall(r"^\| `[\w.]+` \| `([\w.]+)` \|$", text, re.MULTILINE)
        assert len(names) > 50
    else:
        names = re.findall(r"`((?:irl|models|diagrams|experiments)(?:\.\w+)+)`", text)
    for name in names:
        assert exists(name), name


def test_the_torch_of_the_readme_is_the_pinned_one():
    (pinned,) = re.findall(r"^torch==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    assert f"pip install torch=={pinned} --index-url" in (ROOT / "README.md").read_text()


def test_one_range_of_gymnasium_is_told_everywhere():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    told = [
        requirement
        for names in extras["optional-dependencies"].values()
        for requirement in names
        if requirement.startswith("gymnasium")
    ]
    assert told == ["gymnasium>=1.3"] * 2  # the first that has Taxi-v4
    assert "pip install 'gymnasium>=1.3'" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_everything_in_the_packages_is_installed():
    globs = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    for package in ("irl", "models", "diagrams", "experiments"):
        folder = ROOT / package
        patterns = globs["package-data"]["*"] + globs["package-data"].get(package, [])
        shipped = {path for pattern in patterns for path in folder.glob(pattern)}
        others = {
            path
            for path in folder.rglob("*")
            # The programs that speed is compared with are for a checkout.
            if path.is_file()
            and path.suffix != ".py"
            and not {"peers", "__pycache__"} & set(path.parts)
        }
        assert others <= shipped
        assert (folder / "py.typed").is_file()


def test_there_is_one_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["dynamic"] == ["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {irl.__version__}\n" in citation
