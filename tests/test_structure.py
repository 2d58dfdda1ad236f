"""How the house is built: rooms that can be looked over, names that say where they are."""

import ast
from collections import Counter
from itertools import chain
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("irl", "models", "diagrams", "experiments")
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))
FLAT = {"irl", "irl/baselines"}
"""Folders that are flat by decision: a library's public modules, and methods beside one another."""
MOST_MODULES, MOST_PARAMETERS, MOST_LINES = 15, 8, 100
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def inside(path: Path) -> str:
    """A path as it is called from the root."""
    return path.relative_to(ROOT).as_posix()


def modules(folder: Path) -> list[Path]:
    """The modules of a folder, without the files that every package has."""
    return [p for p in sorted(folder.glob("*.py")) if not p.stem.startswith("__")]


FOLDERS = sorted({path.parent for path in FILES})


@pytest.mark.parametrize("folder", FOLDERS, ids=inside)
def test_a_folder_can_be_looked_over(folder):
    if inside(folder) not in FLAT:
        assert len(modules(folder)) <= MOST_MODULES


@pytest.mark.parametrize("folder", FOLDERS, ids=inside)
def test_no_module_repeats_the_name_of_its_folder_or_of_one_beside_it(folder):
    # Beside a package there may be what running leaves, such as out.
    around = [] if folder.parent == ROOT else folder.parent.iterdir()
    beside = [*PACKAGES, *(p.name for p in around if p.is_dir() and p.name[0] not in "._")]
    within = [p.name for p in folder.iterdir() if p.is_dir() and p.name[0] not in "._"]
    for module in modules(folder):
        # By whole words: teacher does not repeat teach.
        named = [n for n in (*beside, *within) if f"{module.stem}_".startswith(f"{n}_")]
        assert not named, f"{inside(module)} repeats {named}"


def test_experiments_hold_a_kit_data_results_stories_and_single_commands():
    folders = [p for p in (ROOT / "experiments").iterdir() if p.is_dir() and any(p.rglob("*.py"))]
    found = {p.name: {m.name for m in p.glob("*.py")} for p in folders}
    # What grasping holds is told by the commands beside it.
    for name in found.keys() - {"kit", "grasping"}:
        assert {"__main__.py", "story.py"} <= found[name], name
    assert (ROOT / "experiments/data").is_dir()
    assert (ROOT / "experiments/results").is_dir()


def parameters(function: ast.FunctionDef) -> int:
    """How many a caller may give, ``*args`` and ``**kwargs`` counted as one each."""
    given = function.args
    named = [a.arg for a in chain(given.posonlyargs, given.args, given.kwonlyargs)]
    stars = (given.vararg is not None) + (given.kwarg is not None)
    return len([name for name in named if name not in ("self", "cls")]) + stars


@pytest.mark.parametrize("path", [*FILES, *TESTS], ids=inside)
def test_functions_stay_small(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, FUNCTIONS):
            lines = node.end_lineno - node.lineno + 1
            assert parameters(node) <= MOST_PARAMETERS, (
                f"{node.name}: {parameters(node)} parameters"
            )
            assert lines <= MOST_LINES, f"{node.name}: {lines} lines"


@pytest.mark.parametrize("path", FILES, ids=inside)
def test_a_pair_is_made_a_number_in_one_place(path):
    """``state * n_actions + action`` stands in `irl.pairs` and `models.task.pairs` alone."""
    if inside(path) in ("irl/pairs.py", "models/task/pairs.py"):
        return
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
            factors = {ast.unparse(node.left).lower(), ast.unparse(node.right).lower()}
            told = {f for f in factors if f.rpartition(".")[2] == "n_actions"}
            states = {f for f in factors - told if "state" in f and "n_states" not in f}
            assert not (told and states), f"line {node.lineno}: {ast.unparse(node)}"


def test_the_algorithm_and_the_methods_take_few_arguments():
    for file, name in (("irl/active.py", "active_fa_mlirl"), ("irl/methods.py", "learn")):
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        (function,) = [n for n in tree.body if isinstance(n, FUNCTIONS) and n.name == name]
        assert parameters(function) <= 7


def test_every_package_says_that_it_is_typed():
    for package in PACKAGES:
        assert (ROOT / package / "py.typed").is_file()


def test_a_command_is_a_story_or_one_module():
    names = [p.stem for p in modules(ROOT / "experiments")]
    names += [p.parent.name for p in (ROOT / "experiments").glob("*/__main__.py")]
    assert max(Counter(names).values()) == 1
