"""Write RESULTS.md's tables from kept results, and say what is missing; make it, if asked to.

Each figure and table of the thesis stands beside ours, with seeds, intervals and the command. What
is kept lies in `experiments/results`; the text of RESULTS.md around the marks stays as it is.
"""

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS
from experiments.report.cells import tabled
from experiments.report.claims import CLAIMS, told
from experiments.report.parts import PARTS, Kept, Part
from irl.choices import Limits, Members, Settings
from irl.errors import InputError
from irl.files import atomic_path

ROOT = Path(__file__).parents[2]
BEGIN = "<!-- From here on `python -m experiments.report` writes; change what it reads. -->"
END = "<!-- What follows is written by hand. -->"


@dataclass(frozen=True)
class Config(Settings):
    """Write RESULTS.md's tables from kept results, and name what is missing."""

    run: bool = False
    """Whether to make first what is missing, was measured in part, or on other task data;
    interrupted, the same command goes on."""
    parts: Annotated[tuple[str, ...], Members(tuple(part.name for part in PARTS))] = tuple(
        part.name for part in PARTS
    )
    """Which parts are made, with --run."""
    again: bool = False
    """Whether parts are made that are there already, with --run."""
    results: Path = ROOT / "experiments" / "results"
    """The folder of the kept results."""
    file: Path = ROOT / "RESULTS.md"
    """The document that is written."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes a part has; the results do not depend on it."""
    out: Path = field(default_factory=lambda: Path("out/report"))
    """The folder that parts are made in."""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Make what is wanted, then write."""
    kept = {part.name: Kept(config.results / part.name) for part in PARTS}
    if config.run:
        chosen = [part for part in PARTS if part.name in config.parts]
        make([p for p in chosen if config.again or kept[p.name].lacks(p)], kept, config, output)
    write(config.file, sections(kept, config))
    lacking = {part: kept[part.name].lacks(part) for part in PARTS}
    for part, lacks in lacking.items():
        if lacks:
            print(f"missing: {part.name}, {lacks} (about {part.minutes} minutes of processor time)")
    there = [part.name for part in PARTS if kept[part.name].there]
    print(f"{len(there)} of {len(PARTS)} parts told in {config.file}")
    return {
        "told": there,
        "missing": [part.name for part in PARTS if part.name not in there],
        "in_part": [part.name for part in PARTS if part.name in there and lacking[part]],
    }


def make(parts: Sequence[Part], kept: dict[str, Kept], config: Config, output: Output) -> None:
    """Run the commands of parts, one after the other, and keep what they leave.

    Raises:
        InputError: if a command fails; what came before it is kept.
    """
    total = sum(part.minutes for part in parts)
    clock = sum(part.clock(config.workers) for part in parts)
    print(
        f"{len(parts)} parts to make: about {total} minutes of processor time, {clock:.0f} by the "
        f"clock with {config.workers} workers on as many free cores",
        flush=True,
    )
    for part in parts:
        print(f"{part.as_typed} (about {part.minutes} minutes)", flush=True)
        out = output.folder / part.name
        command = [sys.executable, "-m", f"experiments.{part.command[0]}", *part.command[1:]]
        command += ["--out", str(out.absolute())]
        if part.workers:
            command += ["--workers", str(config.workers)]
        if subprocess.run(command, cwd=ROOT, check=False).returncode:
            raise InputError("failed; give the same command to go on", place=part.as_typed)
        kept[part.name].keep(part, out)


def sections(kept: dict[str, Kept], config: Config) -> list[str]:
    """All that is written between the marks."""
    return [
        *summary(kept),
        *(line for part in PARTS if kept[part.name].there for line in section(part, kept, config)),
        *absent(kept),
    ]


def summary(kept: dict[str, Kept]) -> list[str]:
    """The table of claims."""
    lines = ["## In ten lines", "", "| claim | figure | command |", "|---|---|---|"]
    results = {name: each.result for name, each in kept.items() if each.there}
    for claim in CLAIMS:
        part = next(part for part in PARTS if part.name == claim[1])
        figure = told(claim, results) or "*not measured yet*"
        if kept[part.name].on_other_task:
            figure += " (on other task data)"
        lines.append(f"| {claim[0]} | {figure} | `{_command(part, kept)}` |")
    return [*lines, ""]


def section(part: Part, kept: dict[str, Kept], config: Config) -> list[str]:
    """One part: command, machine, table, pictures."""
    own = kept[part.name]
    lines = [f"## {part.title}", "", f"`{_command(part, kept)}`{_made(own)}", ""]
    if lacks := own.lacks(part):
        lines += [f"*To be measured again: {lacks}.*", ""]
    lines += own.told(part)
    for name, words in part.pictures:
        if (own.folder / name).exists():
            path = (own.folder / name).absolute()
            base = config.file.absolute().parent
            shown = path.relative_to(base) if path.is_relative_to(base) else path
            lines += [f"![{words}]({shown.as_posix()})", ""]
    return lines


def absent(kept: dict[str, Kept]) -> list[str]:
    """What nobody measured yet, or not on today's task data, or not all of it."""
    lacking = [(part, kept[part.name].lacks(part)) for part in PARTS]
    rows = [
        (part.title, lacks, f"`{part.as_typed}`", str(part.minutes))
        for part, lacks in lacking
        if lacks
    ]
    if not rows:
        return []
    head = ["what", "is missing", "command", "minutes of processor time"]
    told = "`python -m experiments.report --run` makes all of it, `--parts` some of it."
    return ["## Not measured yet", "", *tabled(head, rows), told, ""]


def write(file: Path, lines: Sequence[str]) -> None:
    """Put lines between the marks of a document, which is made if it is not there.

    Raises:
        InputError: if there is a document without the marks.
    """
    before, after = "# Results\n\n", ""
    if file.exists():
        text = file.read_text(encoding="utf-8")
        if BEGIN not in text or END not in text:
            raise InputError(
                "has no marks to write between; put the two comments of "
                "experiments/report/story.py where the tables belong",
                place=str(file),
            )
        before, rest = text.split(BEGIN, 1)
        after = rest.split(END, 1)[1]
    body = "\n".join(lines).strip()
    with atomic_path(file) as path:
        path.write_text(f"{before}{BEGIN}\n\n{body}\n\n{END}{after or chr(10)}", encoding="utf-8")


def _command(part: Part, kept: dict[str, Kept]) -> str:
    """The command that made what is kept; that of the part if nobody noted another."""
    return kept[part.name].made.get("command", part.as_typed)


def _made(kept: Kept) -> str:
    if not kept.made:
        return ""
    versions = ", ".join(f"{name} {number}" for name, number in kept.made["packages"].items())
    return f", on {kept.made['cores']} cores of {kept.made['processor']}; {versions}"
