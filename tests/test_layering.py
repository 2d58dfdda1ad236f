"""Who may know whom: learning runs without a robot, and models without learning."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("irl", "models", "diagrams", "experiments")
FORBIDDEN = {
    "irl": {"pydrake", "models", "diagrams", "experiments"},
    "models": {"irl", "diagrams", "experiments"},
    "diagrams": {"experiments"},
}
# What of learning a diagram may know: the policy it plays, how to report a bad one, and how to
# refuse what other work kept.
DIAGRAMS_KNOW = {"irl.policy", "irl.errors", "irl.identity"}
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Dotted names of all imports, those inside functions included."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            # No relative imports, so that a name says which package it is from.
            assert node.level == 0, f"{path}: relative import in line {node.lineno}"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def test_irl_works_without_robot_and_needs_torch_numpy_scipy_only(tmp_path):
    code = """
import importlib, pkgutil, sys

REFUSED = {
    "pydrake", "models", "diagrams", "experiments",
    "dask", "gymnasium", "matplotlib", "numba", "safetensors", "tqdm", "tyro", "yaml",
}

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in REFUSED:
            raise ImportError(f"{name} must not be needed")

sys.meta_path.insert(0, Refuse())
import irl
for module in pkgutil.walk_packages(irl.__path__, "irl."):
    importlib.import_module(module.name)

import doctest
assert doctest.testmod(irl).failed == 0

import numpy as np
from irl import checkpoint, policy
learnt = policy.Policy.from_q(np.eye(3), np.eye(3) > 0)
policy.save_policy(learnt, sys.argv[1])
assert (policy.load_policy(sys.argv[1]).action == learnt.action).all()
checkpoint.save(sys.argv[1], {"q": learnt.q}, {}, {})
assert (checkpoint.load(sys.argv[1], {})[0]["q"] == learnt.q).all()
assert not REFUSED & {name.split(".")[0] for name in sys.modules}
"""
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "file.safetensors")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("folder", "besides"),
    [
        # gymnasium stands under TYPE_CHECKING, for its environments are handed in.
        # numba is used where it is there: above, everything works without.
        ("irl", {"irl", "gymnasium", "numba"}),
        ("tests/irl", {"irl", "pytest", "hypothesis"}),
    ],
)
def test_irl_and_its_tests_import_no_other_package(folder, besides):
    allowed = {"torch", "numpy", "scipy"} | besides | sys.stdlib_module_names
    own = folder.replace("/", ".") + "."
    for path in sorted((ROOT / folder).rglob("*.py")):
        roots = {name.split(".")[0] for name in imported(path) if not name.startswith(own)}
        assert roots <= allowed, f"{path}: imports {sorted(roots - allowed)}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_stay_within_their_layer(path):
    package = path.relative_to(ROOT).parts[0]
    names = imported(path)
    for name in names:
        assert name.split(".")[0] not in FORBIDDEN.get(package, set()), name
        assert not name.startswith("pydrake.all"), "import from the specific module"
        if package == "diagrams" and name.split(".")[0] == "irl":
            assert ".".join(name.split(".")[:2]) in DIAGRAMS_KNOW, name


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_nothing_is_unpickled(path):
    roots = {name.split(".")[0] for name in imported(path)}
    assert not roots & {"pickle", "cPickle", "dill", "joblib", "cloudpickle", "shelve", "marshal"}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in {"torch.load", "torch.save"}, called
            allowed = {k.arg: ast.unparse(k.value) for k in node.keywords}.get("allow_pickle")
            if called in {"np.load", "numpy.load", "np.lib.format.read_array"}:
                assert allowed == "False", f"{called} in line {node.lineno}"
            assert allowed in {None, "False"}
