"""Task data that the robot can play: its own task, whatever was learnt or changed about it."""

from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from experiments.kit.shipped_data import SHIPPED_TASK
from irl.errors import InputError
from irl.files import sha256
from irl.task_data import TaskData, load_task
from models.task.tables import ACTION_COLUMNS, STATE_COLUMNS, action_rows, state_rows

REMEDY = "give task data of the robot's grasping task, such as 'transitions export' writes"


def load_robot_task(folder: Path) -> TaskData:
    """Read task data, and refuse those of another task than the robot's.

    An index means to the robot what the tables of `models.task.tables` say of it. With others the
    arm would do something else than what was learnt.

    Raises:
        InputError: as `irl.task_data.load_task`, or if ``states.csv`` or ``actions.csv`` are
            not the robot's; then it names the first row that differs.
    """
    task = load_task(folder)
    for file, found, columns, rows in (
        ("states.csv", task.states, STATE_COLUMNS, state_rows),
        ("actions.csv", task.actions, ACTION_COLUMNS, action_rows),
    ):
        # The shipped tables are known to be right, and equal bytes are soon found out.
        if sha256(Path(folder) / file) != _shipped(file):
            _require_rows(Path(folder) / file, found, columns, rows())
    return task


@cache
def _shipped(file: str) -> str:
    return sha256(SHIPPED_TASK / file)


def _require_rows(
    path: Path,
    found: list[dict[str, str]],
    columns: Iterable[str],
    rows: Iterator[tuple[str, ...]],
) -> None:
    """Refuse a table that differs from the robot's.

    Args:
        path: the file, for messages.
        found: its rows by column, ``index`` left out.
        columns: of the robot's table, ``index`` first.
        rows: of the same.
    """
    wanted = list(rows)
    if len(found) != len(wanted):
        raise InputError(
            f"{len(found)} rows, where the robot's task has {len(wanted)}; {REMEDY}",
            place=str(path),
        )
    for number, (row, robots) in enumerate(zip(found, wanted, strict=True)):
        own = dict(zip(columns, robots, strict=True))
        del own["index"]
        if row != own:
            name = next(name for name in {**own, **row} if row.get(name) != own.get(name))
            raise InputError(
                f"row {number}, field {name!r} is {row.get(name, 'absent')!r:.40}, where the "
                f"robot's task has {own.get(name, 'nothing')!r}; {REMEDY}",
                place=str(path),
            )
