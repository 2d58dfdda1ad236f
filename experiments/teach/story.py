"""Teach: a person shows and advises, the learner asks, and says when it has learnt enough.

Everything said is in the lesson's file before the next question. Killed, it goes on with the same
command. What came of a lesson is learnt over again, to the bit, with ``--replay``.
"""

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from experiments.kit.command import Output
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.desk import Desk, DeskConfig
from experiments.teach.files import export, plain, take_in
from experiments.teach.review import Record, report, show_report
from experiments.teach.rounds import LocalLearner, ThreadLearner
from experiments.teach.shell.commands import QUIT, perform, read_script, settle
from experiments.teach.shell.scripted import answer_as_the_oracle, demonstrated
from experiments.teach.shell.terminal import teach
from experiments.teach.students import USE_RULES, rules_of, student_config
from experiments.teach.worlds import World, grid_world, robot_world
from irl.choices import Limits, Settings
from irl.errors import InputError
from irl.identity import require_same_work
from irl.lesson import Lesson
from irl.lesson_replay import began, config_of, replay
from irl.lesson_taught import Taught
from irl.policy import save_policy
from irl.student import Student

LESSON = "lesson.db"


@dataclass(frozen=True)
class Config(Settings):
    """Teach the robot, or with --grid a grid, by showing and advising."""

    task: Path = SHIPPED_TASK
    """The folder that the task data are read from."""
    grid: Annotated[int, Limits(0, 101)] = 0
    """Teach the grid of so many cells a side in place of the robot; 0 teaches the robot."""
    lesson: Path | None = None
    """The lesson's file, to begin or to go on with; lesson.db in the output folder if not given."""
    learner: Literal["goal_posterior", "planning", "fa_mlirl"] = "goal_posterior"
    """Who learns. From few answers the first one learns most, and it alone knows when it is enough;
    of the others it is said when their policy stopped changing."""
    terminal: bool = False
    """Ask in the terminal, in place of a page in the browser."""
    host: str = "127.0.0.1"
    """The address that the page is bound to. Elsewhere than on this machine it asks for a token,
    which is in the address that is printed."""
    port: Annotated[int, Limits(0, 65535)] = 8080
    """The port of the page; 0 takes any that is free."""
    browser: bool = True
    """Whether to open the page in the browser."""
    script: Path | None = None
    """A file of answers and other commands, as JSON lines, in place of a person."""
    oracle: Annotated[int, Limits(0, 100_000)] = 0
    """Let a simulated mind answer so many questions at most, in place of a person, until it is
    enough."""
    synchronous: bool = False
    """A round of learning after each answer, and the questions that the algorithm would ask;
    without it episodes go on, and learning hides behind them."""
    hold_out: bool = False
    """Keep every tenth answer from the learner, to judge its policy by in the report."""
    generalise: bool = False
    """Whether rules label what follows from a grasp, a carry or a turn as well, where fa_mlirl
    learns; the page shows six of these states, to be refused where that does not follow. Without
    them, where it learns more from one trajectory, and of the other learners, which plan, the page
    shows what they do otherwise for an answer."""
    initial: Annotated[int, Limits(0, 1000)] = 0
    """How many trajectories a simulated mind shows before the first question; without any the
    lesson begins empty."""
    demonstrations: Path | None = None
    """A file of demonstrations, as demonstrations.csv in the task data, to take into the lesson."""
    advice: Path | None = None
    """A file of advice, as advice.json of an earlier lesson, to take into the lesson."""
    merge: Path | None = None
    """Another lesson about the same task to take in; contradictions are listed, none is decided."""
    replay: Path | None = None
    """Learn that lesson over again, compare the policy's hash with the one that it holds, and tell
    all that a lesson's report has."""
    seed: Annotated[int, Limits(0, 2**32 - 1)] = 0
    """The seed of every random draw."""
    out: Path = field(default_factory=lambda: Path("out/teach"))
    """The folder that the results are written to."""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Teach, or learn a lesson over again."""
    world = grid_world(config.grid) if config.grid else robot_world(config.task)
    if config.replay is not None:
        return replayed(world, config.replay, output)
    path = config.lesson or output.folder / LESSON
    with open_lesson(world, config, path) as lesson:
        if not (config.terminal or config.script or config.oracle):
            return in_the_browser(world, config, lesson, output)
        _on_one_thread()
        student = Student(world.subject, config_of(lesson, world.subject), lesson.initial)
        learner = (
            LocalLearner(student) if config.script or config.oracle else ThreadLearner(student)
        )
        desk = Desk(world, lesson, learner, DeskConfig(config.synchronous, config.hold_out))
        conflicts = take_in(desk, config.demonstrations, config.advice, config.merge)
        if config.script is not None:
            run_script(desk, config.script)
        elif config.oracle:
            answer_as_the_oracle(desk, config.oracle, np.random.default_rng(config.seed))
        else:
            teach(desk)
        return finished(desk, output) | {"conflicts": plain(conflicts)}


def in_the_browser(world: World, config: Config, lesson: Lesson, output: Output) -> dict[str, Any]:
    """Teach in a page until the program is interrupted.

    Raises:
        InputError: if what the page needs is not installed, or its address is taken.
    """
    try:
        from experiments.teach.page.server import (  # noqa: PLC0415 - an optional extra
            Address,
            Subject,
            serve,
        )
    except ModuleNotFoundError as error:
        raise InputError(
            f"the page needs {error.name}: pip install 'active-advice-irl[teach]', or give "
            "--terminal"
        ) from None
    if config.synchronous:  # then it is the server that learns
        _on_one_thread()
    again = (grid_world, (config.grid,)) if config.grid else (robot_world, (config.task,))
    subject = Subject(world, *again)
    conflicts: list = []

    def prepare(desk: Desk) -> None:
        conflicts.extend(take_in(desk, config.demonstrations, config.advice, config.merge))

    desk = serve(
        subject,
        lesson,
        DeskConfig(config.synchronous, config.hold_out),
        Address(config.host, config.port, config.browser),
        prepare,
    )
    return finished(desk, output, wait=False) | {"conflicts": plain(conflicts)}


def open_lesson(world: World, config: Config, path: Path) -> Lesson:
    """Begin a lesson, or go on with the one that is there.

    Raises:
        InputError: if the file there is no lesson, or one of another learner, task or seed, or if
            the learner takes no labels from rules and is to.
    """
    student = student_config(config.learner, config.seed, grid=bool(config.grid))
    if config.generalise:
        if config.learner not in USE_RULES:
            raise InputError(
                f"{config.learner} takes no labels from rules",
                place="generalise: learner",
                valid=USE_RULES,
            )
        student = replace(student, rules=rules_of(world, config.learner))
    if not path.exists():
        rng = np.random.default_rng([config.seed, 1])
        initial = demonstrated(world, config.initial, rng)
        return Lesson.begin(path, began(world.subject, student, initial))
    lesson = Lesson(path)
    try:
        kept = config_of(lesson, world.subject)
        require_same_work(path, asdict(kept), asdict(student), "take another --lesson or --out")
    except BaseException:
        lesson.close()
        raise
    return lesson


def run_script(desk: Desk, path: Path) -> None:
    """Do what a script says; what it said before something that cannot be done is kept."""
    for place, command in read_script(path):
        if command.get("do") == QUIT:
            break
        try:
            print(perform(desk, command))
        except InputError as error:
            raise InputError(str(error), place=place) from None
    settle(desk)


def finished(desk: Desk, output: Output, *, wait: bool = True) -> dict[str, Any]:
    """Write what came of a lesson, and tell it.

    With ``wait`` once all that was said is learnt, and with the answers that are at odds with the
    rest; else at once.
    """
    if wait:
        settle(desk)
    export(desk, output)
    told = report(desk, odd=wait)
    show_report(desk.world, told)
    if told["at_odds"] is None and told["answers"]:
        print(f"which answers are at odds with the rest tells --replay {desk.lesson.path}")
    policy, enough = desk.policy, desk.enough
    if policy is not None:
        with output.file("policy.safetensors") as path:
            save_policy(policy, path)
    print(f"{'enough' if enough.enough else 'not enough'}: {enough.reason}")
    return {
        "answers": len(desk.taught.answers),
        "policy_hash": None if desk.learnt is None else desk.learnt.policy_hash,
        "enough": enough.enough,
        "enough_reason": enough.reason,
        "enough_stands_in": enough.stands_in,
        "success_mdp": None if policy is None else desk.world.success(policy.action),
        "learner": desk.student.method,
        "rounds": desk.rounds.next,
        "lesson": str(desk.lesson.path),
        "report": told,
    }


def replayed(world: World, path: Path, output: Output) -> dict[str, Any]:
    """Learn a lesson over again.

    Raises:
        InputError: if the policy is another one than the lesson's.
    """
    _on_one_thread()
    with Lesson(path, writable=False) as lesson:
        again = replay(lesson, world.subject)
        taught = Taught.of(lesson.events)
        student = config_of(lesson, world.subject)
        told = report(Record(world, lesson, student, taught, again.policy))
    print(f"round {again.k}: {again.policy_hash}")
    if not again.same:
        others = f" (other versions: {', '.join(again.differing)})" if again.differing else ""
        raise InputError(
            f"round {again.k} came to {again.policy_hash[:12]}… here, to {again.recorded[:12]}… "
            f"in the lesson{others}",
            place=str(path),
        )
    show_report(world, told)
    with output.file("policy.safetensors") as target:
        save_policy(again.policy, target)
    enough = again.learnt.enough
    return {
        "answers": len(taught.answers),
        "policy_hash": again.policy_hash,
        "enough": enough.enough,
        "enough_reason": enough.reason,
        "enough_stands_in": enough.stands_in,
        "success_mdp": world.success(again.policy.action),
        "round": again.k,
        "report": told,
    }


def _on_one_thread() -> None:
    """Learn on one thread: small matrices, and bits that do not depend on the machine's cores."""
    import torch  # noqa: PLC0415 - not wanted where another process learns

    torch.set_num_threads(1)
