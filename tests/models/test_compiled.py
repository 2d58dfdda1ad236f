"""Compiled functions on disk: loaded while nothing has changed, made anew when anything has."""

import importlib
import inspect
import os
import pkgutil
import subprocess
import sys
from types import ModuleType

import pytest
from numba.core.dispatcher import Dispatcher

import models
from models.compiled import NOTICE

LENGTHS = "LENGTH = 2.0\n"
INNER = """
from lengths import LENGTH
from models.compiled import FAST, compiled

@compiled(**FAST)
def doubled(x):
    return LENGTH * x
"""
OUTER = """
from inner import doubled
from models.compiled import compiled

@compiled()
def shifted(x):
    return doubled(x) + 1.0

print(shifted(3.0), *shifted.stats.cache_hits.values())
"""


FILES = {"lengths": LENGTHS, "inner": INNER, "outer": OUTER}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Answer of the outermost function in a fresh process, the number of its cache hits, stderr."""
    folder = tmp_path_factory.mktemp("modules")

    def answer(**changes):
        for name, text in {**FILES, **changes}.items():
            (folder / f"{name}.py").write_text(text)
        path = os.pathsep.join([str(folder), *filter(None, sys.path)])
        environment = {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder / "kept")}
        done = subprocess.run(
            [sys.executable, folder / "outer.py"], env=environment, capture_output=True, check=True
        )
        return done.stdout.decode().split(), done.stderr.decode()

    # Two functions are compiled, and one line says so.
    assert answer() == (["7.0"], f"models: {NOTICE}\n")
    return answer


def test_what_has_not_changed_is_loaded(run):
    assert run() == (["7.0", "1"], "")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"inner": INNER.replace("LENGTH * x", "LENGTH * x * x")}, "19.0"),
        ({"lengths": "LENGTH = 5.0\n"}, "16.0"),
        ({"inner": INNER.replace("(**FAST)", "()")}, "7.0"),
    ],
    ids=["code of a callee", "constant of a callee", "options of a callee"],
)
def test_a_change_in_another_file_compiles_anew(run, changes, expected):
    assert run(**changes)[0] == [expected]


def test_compiled_functions_take_nothing_from_modules_of_ours_but_by_name():
    """Attributes of a module would escape the key."""
    seen = 0
    for _, name, _ in pkgutil.walk_packages(models.__path__, "models."):
        for value in vars(importlib.import_module(name)).values():
            if isinstance(value, Dispatcher):
                seen += 1
                used = inspect.getclosurevars(value.py_func).globals.values()
                own = [v for v in used if isinstance(v, ModuleType) and "models" in v.__name__]
                assert not own, f"{name}.{value.py_func.__name__}"
                assert not value.py_func.__closure__
    assert seen > 20
