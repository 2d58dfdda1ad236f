"""Does the hand keep the cube while the arm swings at growing acceleration, up to its limits?"""

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from tqdm import tqdm

from diagrams.contact import TIME_STEP
from diagrams.gripper_controller import FORCE_RANGE, GRIP_FORCE
from experiments.hold import arm, robosuite
from experiments.hold.cases import Case, heavy, regular, row
from experiments.hold.held import LOOK, LOST, SLIPS
from experiments.hold.plots import plot_margin, plot_verdicts
from experiments.hold.rig import Load
from experiments.hold.swings import swings
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS, mapper
from experiments.kit.kept_rows import KeptRows
from irl.choices import Limits, Members, Settings
from irl.errors import InputError

KEYS = tuple(swings())
BOUND = 2.0
"""From this ratio of friction to what it must hold on, no cube may be lost."""
SHOWN = ("sweep-across", "sideways-closing", "up-down-across", "up-down-approach")
"""Swings of the recording, as far as they are chosen."""


@dataclass(frozen=True)
class Config(Settings):
    """Hold the cube while the arm swings, and see whether it holds, slips or is lost."""

    swings: Annotated[tuple[str, ...], Members(KEYS)] = KEYS
    """How the arm swings, and which axis of the hand it swings along."""
    shares: Annotated[tuple[float, ...], Limits(0, 1, open_low=True, some=True)] = (0.4, 0.7, 1.0)
    """Which shares of the joints' acceleration limits."""
    masses: Annotated[tuple[float, ...], Limits(0.01, 5, some=True)] = (0.05, 0.2, 0.5)
    """The masses of the cube [kg]."""
    frictions: Annotated[tuple[float, ...], Limits(0.05, 2, some=True)] = (0.5, 0.9)
    """The coefficients of friction."""
    heavy: Annotated[tuple[float, ...], Limits(0.01, 20)] = (1.0, 1.5, 2.0, 3.0)
    """Masses to see it fail with, held as weakly as the gripper can [kg]."""
    force: Annotated[float, Limits(*FORCE_RANGE)] = GRIP_FORCE
    """The force of each pad [N]."""
    time_step: Annotated[float, Limits(5e-4, LOOK)] = TIME_STEP
    """The simulator's step [s], of which there is a whole number in 2 ms; it is halved too."""
    arm: bool = True
    """Whether the whole arm swings too, for comparison and for a recording."""
    peers: Path = robosuite.PYTHON
    """The Python interpreter of the environment that has robosuite; without one it is left out."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 1
    """How many processes; the results do not depend on it."""
    out: Path = Path("out/hold")
    """The folder that the results are written to."""

    def __post_init__(self) -> None:
        """Refuse a time step that looks at the cube don't fall on."""
        super().__post_init__()
        steps = LOOK / self.time_step
        if abs(steps - round(steps)) > 1e-9:
            raise InputError(
                f"{self.time_step:g} s; 2 ms must be a whole number of steps", place="time_step"
            )

    @property
    def cases(self) -> list[Case]:
        """All cases, those to fail with last."""
        return [
            *regular(self.swings, self.shares, self.masses, self.frictions, self.force),
            *heavy(self.swings, self.heavy, min(self.frictions)),
        ]

    @property
    def arm_cases(self) -> list[Case]:
        """The swings at the limits, with the most that is held."""
        load = Load(max(self.masses), min(self.frictions), self.force)
        return [Case(key, max(self.shares), load) for key in self.swings] if self.arm else []


def main(config: Config, output: Output) -> dict[str, Any]:
    """Hold the cube in every case, beside robosuite's hand and by the whole arm; tabulate."""
    cases, arm_cases = config.cases, config.arm_cases
    why_not = robosuite.missing(config.peers)
    if why_not:
        print(f"robosuite is left out: {why_not}")
    rows, arm_rows = measure(config, output, cases, arm_cases)
    if not why_not:
        others = robosuite.hold_all(config.peers, cases)
        rows = [{**own, **other} for own, other in zip(rows, others, strict=True)]
    with output.file("cases.csv") as path, path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    with output.figure("verdicts.png") as figure:
        plot_verdicts(figure, rows)
    with output.figure("margin.png") as figure:
        plot_margin(figure, rows, BOUND)
    shown = [case for case in arm_cases if case.swing in SHOWN]
    if shown:
        with (
            output.file("recording.html") as path,
            tqdm(desc="recording", total=len(shown), unit="swing") as bar,
        ):
            arm.record(shown, path, bar.update)
    KeptRows(output, identity(config)).forget()
    result = {**summary(rows), "robosuite": why_not or "compared", "arm": arm_rows, "rows": rows}
    print_summary(result)
    return result


def identity(config: Config) -> dict[str, Any]:
    """What kept rows depend on."""
    left_out = {"out", "workers", "peers"}
    return {name: value for name, value in asdict(config).items() if name not in left_out}


def measure(
    config: Config, output: Output, cases: Sequence[Case], arm_cases: Sequence[Case]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Rows of all cases, and of the whole arm's, in their order; those that are kept are not run.

    Args:
        config: of the command.
        output: where rows are kept.
        cases: held by the hand on slides.
        arm_cases: held by the whole arm.
    """
    kept = KeptRows(output, identity(config))
    jobs = [partial(row, case, config.time_step) for case in cases]
    jobs += [partial(arm.compare, case, config.time_step) for case in arm_cases]
    with (
        mapper(config.workers) as over,
        tqdm(desc="hold", total=len(jobs), initial=len(kept.rows), unit="case") as bar,
    ):
        for found in over(_call, jobs[len(kept.rows) :]):
            kept.add(found)
            bar.update()
    rows = kept.rows
    return rows[: len(cases)], rows[len(cases) :]


def _call(job: partial[dict[str, Any]]) -> dict[str, Any]:
    return job()


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How often which verdict, and where verdicts differ."""
    engines = {"ours": "", "halved": "halved_"}
    if "mujoco_verdict" in rows[0]:
        engines["mujoco"] = "mujoco_"
    within = [r for r in rows if r["ratio"] > BOUND]
    return {
        "cases": len(rows),
        "largest_acceleration_m_s2": max(r["acceleration_m_s2"] for r in rows),
        "within_bound": len(within),
        "engines": {
            name: {
                "verdicts": dict(Counter(r[f"{prefix}verdict"] for r in rows)),
                "lost_within_bound": sum(r[f"{prefix}verdict"] == LOST for r in within),
                "slips_within_bound": sum(r[f"{prefix}verdict"] == SLIPS for r in within),
                "largest_slip_within_bound_mm": max(
                    (r[f"{prefix}slip_mm"] or 0.0 for r in within), default=0.0
                ),
                "most_chatter_within_bound": max(
                    (r[f"{prefix}chatter"] or 0 for r in within), default=0
                ),
                "other_verdict_than_ours": sum(r[f"{prefix}verdict"] != r["verdict"] for r in rows),
            }
            for name, prefix in engines.items()
        },
    }


def print_summary(result: Mapping[str, Any]) -> None:
    """Tell what was found."""
    print(
        f"{result['cases']} cases, up to {result['largest_acceleration_m_s2']:.1f} m/s²; in "
        f"{result['within_bound']} friction is more than {BOUND:g} × what it must hold"
    )
    for name, found in result["engines"].items():
        verdicts = ", ".join(f"{verdict} {n}" for verdict, n in found["verdicts"].items())
        print(
            f"{name:>7}: {verdicts}; of those within the bound lost "
            f"{found['lost_within_bound']}, slip at most "
            f"{found['largest_slip_within_bound_mm']:.3f} mm; "
            f"{found['other_verdict_than_ours']} unlike ours"
        )
    for found in result["arm"]:
        print(
            f"{found['swing']}: by the whole arm {found['displacement_mm']:.3f} mm, "
            f"{found['halved_displacement_mm']:.3f} with half the step; "
            f"on slides {found['slides_slip_mm']:.3f}"
        )
