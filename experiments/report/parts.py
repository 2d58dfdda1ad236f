"""What RESULTS.md is made of: a command each, how long it takes, and how its result is told."""

import json
import os
import platform
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.report import domain_tables, hidden_tables, network_tables
from irl.errors import InputError
from irl.files import atomic_path, sha256
from irl.formats import read_json, write_json

PACKAGES = ("drake", "torch", "numpy", "scipy", "numba")
RESULT, MADE, TASK_FILE = "result.json", "made.json", "task.json"


@dataclass(frozen=True)
class Part:
    """One figure or table.

    Attributes:
        name: its folder among the kept results.
        title: of its section; names what of the thesis it stands beside.
        command: of `experiments`, without where to write.
        minutes: of processor time that it takes about.
        tell: the section's lines, from the result.
        pictures: files that the command leaves and the section shows, with what they show.
        workers: whether the command takes ``--workers``.
    """

    name: str
    title: str
    command: tuple[str, ...]
    minutes: int
    tell: Callable[[dict[str, Any]], list[str]]
    pictures: tuple[tuple[str, str], ...] = ()
    workers: bool = True

    @property
    def as_typed(self) -> str:
        """The command as a person types it."""
        return f"python -m experiments.{' '.join(self.command)}"

    @property
    def on_task(self) -> bool:
        """Whether it is measured on the shipped task data."""
        return self.command[0] == "grasping"

    def clock(self, workers: int) -> float:
        """Minutes by the clock that it takes about, on as many free cores."""
        return self.minutes / workers if self.workers else self.minutes


@dataclass(frozen=True)
class Kept:
    """What is kept of a part.

    Attributes:
        folder: of its files.
    """

    folder: Path

    @property
    def there(self) -> bool:
        """Whether there is a result."""
        return (self.folder / RESULT).exists()

    @cached_property
    def result(self) -> dict[str, Any]:
        """The result.

        Raises:
            InputError: if it is no JSON object.
        """
        result = read_json(self.folder / RESULT)
        if not isinstance(result, dict):
            raise InputError("an object is needed; delete it", place=str(self.folder / RESULT))
        return result

    @cached_property
    def made(self) -> dict[str, Any]:
        """The command, machine and versions; empty if nobody noted them."""
        path = self.folder / MADE
        made = read_json(path) if path.exists() else {}
        return made if isinstance(made, dict) else {}

    @property
    def on_other_task(self) -> bool:
        """Whether it was measured on other task data than are shipped now."""
        return self.made.get("task", shipped_task()) != shipped_task()

    def lacks(self, part: Part) -> str:
        """What is missing of a part, in words; nothing if it is whole."""
        if not self.there:
            return "all"
        if self.on_other_task:
            return f"it was measured on other task data, {self.made['task'][:8]}…"
        if self.made.get("command", part.as_typed) != part.as_typed:
            return "less was measured than this command does"
        return ""

    def told(self, part: Part) -> list[str]:
        """The section's lines.

        Raises:
            InputError: if the result is of another form than today's.
        """
        try:
            return part.tell(self.result)
        except (LookupError, TypeError) as error:
            raise InputError(
                f"does not have what is told of it ({error!r:.60}); make it anew: "
                f"python -m experiments.report --run --again --parts {part.name}",
                place=str(self.folder / RESULT),
            ) from error

    def keep(self, part: Part, out: Path) -> None:
        """Take over what a command left in ``out``."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for name, _ in part.pictures:
            with atomic_path(self.folder / name) as path:
                shutil.copyfile(out / name, path)
        rounded = json.loads((out / RESULT).read_text(), parse_float=_rounded)
        with atomic_path(self.folder / RESULT) as path:
            path.write_text(json.dumps(rounded, separators=(",", ":")) + "\n")
        on = {"task": shipped_task()} if part.on_task else {}
        with atomic_path(self.folder / MADE) as path:
            write_json(path, {"command": part.as_typed, **on, **machine()})
        for read_before in ("result", "made"):
            self.__dict__.pop(read_before, None)


def _rounded(number: str) -> float:
    """Six digits are more than any interval leaves certain."""
    return float(f"{float(number):.6g}")


@cache
def shipped_task() -> str:
    """The hash of the task data that are shipped now."""
    return sha256(SHIPPED_TASK / TASK_FILE)


def machine() -> dict[str, Any]:
    """What figures depend on besides the code."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": (models or [platform.machine()])[0],
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "packages": {name: version(name) for name in PACKAGES},
    }


PARTS: Sequence[Part] = (
    Part(
        "grasping/table",
        "Table 6.3: states, questions and advice",
        ("grasping", "table"),
        47,
        network_tables.table_6_3,
        (
            ("accuracy.png", "Accuracy by demonstration set and advice"),
            ("curves.png", "Success and accuracy from label to label"),
        ),
    ),
    Part(
        "grasping/ladder",
        "What buys what: from the thesis' network to ours",
        ("grasping", "ladder"),
        25,
        network_tables.ladder,
        (("ladder.png", "One change at a time"),),
    ),
    Part(
        "grasping/advice",
        "Few labels, and what advice is worth (thesis 4.2, 6.3)",
        ("grasping", "advice"),
        6,
        network_tables.advice,
    ),
    Part(
        "grasping/questions",
        "What asking well is worth (thesis 4.1, 7.3)",
        ("grasping", "questions"),
        75,
        network_tables.questions,
        (("gains.png", "What each way to ask gains over chance"),),
    ),
    Part(
        "grasping/clusters",
        "Clusters that nobody drew (thesis 7.2, 7.3)",
        ("grasping", "clusters"),
        6,
        network_tables.clusters,
    ),
    Part(
        "grasping/network",
        "The network's size (thesis 7.3)",
        ("grasping", "network"),
        15,
        network_tables.network,
    ),
    Part(
        "grasping/model_free",
        "Without a transition model (thesis 7.3)",
        ("grasping", "model_free"),
        10,
        network_tables.model_free,
    ),
    Part(
        "grasping/larger",
        "A larger problem (thesis 7.3)",
        ("grasping", "larger"),
        10,
        network_tables.larger,
    ),
    Part(
        "grasping/rewards",
        "Twenty hidden rewards",
        ("grasping", "rewards", "--number", "20"),
        120,
        hidden_tables.rewards,
    ),
    Part(
        "grasping/enough",
        "Knowing when it is enough",
        ("grasping", "enough", "--lessons", "200"),
        90,
        hidden_tables.enough,
        (("lessons.png", "How good the learner was when a lesson was over"),),
    ),
    Part(
        "grasping/outside",
        "A goal that the learner cannot think of",
        ("grasping", "enough", "--about", "outside", "--lessons", "40"),
        45,
        hidden_tables.enough,
        (("lessons.png", "The same, where the goal is none that the learner can think of"),),
    ),
    Part(
        "grasping/ensemble",
        "Knowing when it is enough, without a posterior",
        ("grasping", "ensemble"),
        150,
        network_tables.ensemble,
    ),
    Part(
        "grasping/planning",
        "One trajectory, and labels often wrong: planning",
        ("grasping", "planning"),
        8,
        hidden_tables.planning,
        workers=False,
    ),
    Part(
        "gridworld",
        "Table 6.2, Figures 6.3 to 6.6: grid-worlds",
        ("gridworld", "--sizes", "7", "25", "35", "101"),
        10,
        domain_tables.gridworld,
        (("accuracy.png", "Accuracy by iteration"), ("preferences.png", "State preferences")),
    ),
    Part(
        "complexity",
        "Table 6.1: seconds an iteration",
        ("complexity",),
        10,
        domain_tables.complexity,
        (("complexity.png", "Seconds by states and method"),),
        workers=False,
    ),
    Part(
        "sailing",
        "Figures 6.1 and 6.2: advice about sailing",
        ("sailing",),
        4,
        domain_tables.sailing,
        (("figure_6_1.png", "Figure 6.1"), ("figure_6_2.png", "Figure 6.2")),
    ),
)
