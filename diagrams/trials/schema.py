"""Tables of the trial database, and whether a file has them and nothing else."""

import sqlite3
from contextlib import closing
from pathlib import Path

from models.errors import ModelError

SCHEMA_VERSION = 4
"""Of the tables that are made, kept as the file's ``user_version``. Its noise has restitution."""
READABLE = (2, 3, SCHEMA_VERSION)
"""Versions that are read; rows are added to today's alone. Those of version 2 have no digest."""
_WITH_DIGEST = 3

_CONFIGURATION = """CREATE TABLE configuration (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    hash TEXT NOT NULL,
    content TEXT NOT NULL
)"""
_TRIAL = """CREATE TABLE trial (
    configuration TEXT NOT NULL,
    state INTEGER NOT NULL,
    action INTEGER NOT NULL,
    repetition INTEGER NOT NULL,
    class INTEGER NOT NULL,
    seed TEXT NOT NULL,
    outcome TEXT NOT NULL,
    next_state INTEGER NOT NULL,
    turn_x REAL NOT NULL, turn_y REAL NOT NULL, turn_z REAL NOT NULL,
    displacement_x REAL NOT NULL, displacement_y REAL NOT NULL, displacement_z REAL NOT NULL,
    snap_angle REAL NOT NULL,
    drift REAL NOT NULL,
    lift_height REAL NOT NULL,
    clearance REAL NOT NULL,
    slip REAL NOT NULL,
    in_hand_rotation REAL NOT NULL,
    pad_force REAL NOT NULL,
    opening REAL NOT NULL,
    speed REAL NOT NULL,
    noise TEXT NOT NULL,
    draws INTEGER NOT NULL,
    fault TEXT NOT NULL,
    cpu_s REAL NOT NULL,
{digest}    UNIQUE (configuration, state, action, repetition)
)"""


def tables(version: int) -> list[str]:
    """Statements that make the tables of a schema version."""
    digest = "    digest TEXT NOT NULL,\n" if version >= _WITH_DIGEST else ""
    return [_CONFIGURATION, _TRIAL.format(digest=digest)]


def stored_version(connection: sqlite3.Connection, path: Path) -> int | None:
    """Schema version of a file; None if it holds nothing at all yet.

    Args:
        connection: to the file.
        path: of the file, for messages.

    Raises:
        ModelError: if the file is damaged, is not a trial database, is of a version that is not
            read, or has not exactly the tables of its version; names the table and column.
        sqlite3.Error: if it cannot be read at all.
    """
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    found = _master(connection)
    if not found and not version:
        return None
    wanted = _definitions(version if version in READABLE else SCHEMA_VERSION)
    strangers = sorted(found.keys() ^ wanted.keys(), key=lambda key: key[1] != "table")
    if strangers and strangers[0][1] == "table":
        raise ModelError(f"{path}: not a trial database: {_stranger(strangers[0], found)}")
    if version not in READABLE:
        raise ModelError(
            f"{path}: schema version {version}; supported: "
            f"{', '.join(map(str, READABLE))}; make another database"
        )
    for key, definition in wanted.items():
        if key in found and found[key] != definition:
            raise ModelError(
                f"{path}: table {key[0]!r}: {_difference(connection, key[0], version)}"
            )
    if strangers:
        raise ModelError(f"{path}: not a sound trial database: {_stranger(strangers[0], found)}")
    damage = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
    if damage != "ok":
        raise ModelError(f"{path}: damaged ({' '.join(str(damage).split())})")
    return version


def columns(connection: sqlite3.Connection, table: str) -> list[str]:
    """Names of a table's columns, in order."""
    return [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]


def _stranger(key: tuple[str, str], found: dict[tuple[str, str], str | None]) -> str:
    """What a file holds in excess, or lacks."""
    name, kind = key
    told = "not one of its" if key in found else "missing"
    return f"{kind} {name!r} is {told}; wanted tables configuration, trial and no others"


def _master(connection: sqlite3.Connection) -> dict[tuple[str, str], str | None]:
    """Definition by name and type of all that a file holds, SQLite's own tables included."""
    rows = connection.execute("SELECT name, type, sql FROM sqlite_master")
    return {(str(name), str(kind)): sql for name, kind, sql in rows}


def _definitions(version: int) -> dict[tuple[str, str], str | None]:
    """What a sound file of a version holds."""
    with closing(_made(version)) as connection:
        return _master(connection)


def _made(version: int) -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:")
    for statement in tables(version):
        connection.execute(statement)
    return connection


def _difference(connection: sqlite3.Connection, table: str, version: int) -> str:
    """How a table's columns differ from those wanted."""
    with closing(_made(version)) as sound:
        wanted = columns(sound, table)
    found = columns(connection, table)
    for name in wanted:
        if name not in found:
            return f"column {name!r} is missing; wanted {', '.join(wanted)}"
    for name in found:
        if name not in wanted:
            return f"column {name!r} is not one of its; wanted {', '.join(wanted)}"
    return f"types, constraints or order of its columns are not those of version {version}"
