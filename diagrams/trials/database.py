"""The trial database: SQLite, append-only, one row a trial (the truth that task data come from)."""

import hashlib
import json
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from diagrams.trials.record import Noise, Outcome, Pair, Trial, TrialConfig, TrialRecord, spawn_key
from irl.identity import require_same_work
from models.errors import ModelError
from models.task.trial_classes import trial_classes

SCHEMA_VERSION = 2
"""Of the tables, kept as the file's ``user_version``."""
_SCHEMA = f"""
BEGIN IMMEDIATE;
PRAGMA user_version = {SCHEMA_VERSION};
CREATE TABLE IF NOT EXISTS configuration (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    hash TEXT NOT NULL,
    content TEXT NOT NULL
);
CREATE TABLE IF NOT EXISTS trial (
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
    UNIQUE (configuration, state, action, repetition)
);
COMMIT;
"""
"""Whole or not at all, so that who looks while a database is made sees no part of it."""
_VECTORS = ("turn", "displacement")
_PLAIN = (
    "outcome",
    "next_state",
    "snap_angle",
    "drift",
    "lift_height",
    "clearance",
    "slip",
    "in_hand_rotation",
    "pad_force",
    "opening",
    "speed",
    "draws",
    "fault",
    "cpu_s",
)
_KEY = ("state", "action", "repetition")


FLOATING: Final = "floating"
ARM: Final = "arm"


@dataclass(frozen=True)
class Campaign:
    """What a database's trials have in common.

    Attributes:
        trial: how each is run.
        seed: root of every trial's own seed.
        description: `models.scenes.parsing.description_hash` of the simulated models.
        drake: version of the simulator.
        rig: `FLOATING`, a gripper without an arm, or `ARM`, the whole station.
        reachability_map: SHA-256 of the map that the arm's motions are planned on, else empty.
    """

    trial: TrialConfig
    seed: int
    description: str
    drake: str
    rig: str = FLOATING
    reachability_map: str = ""

    def content(self) -> dict[str, Any]:
        """Return plain values, as stored."""
        return json.loads(json.dumps(asdict(self)))

    @property
    def hash(self) -> str:
        """SHA-256 of the content."""
        return hashlib.sha256(json.dumps(self.content(), sort_keys=True).encode()).hexdigest()


class TrialDatabase:
    """Trials of one campaign on disk; every committed trial survives a kill."""

    def __init__(self, path: Path, campaign: Campaign | None = None) -> None:
        """Open or create a database.

        Args:
            path: of the file; its folder is made if missing.
            campaign: to record trials under; None opens an existing database for reading.

        Raises:
            ModelError: if the file is not a trial database, is of another schema version, is
                missing and ``campaign`` is None, or cannot be written.
            InputError: if it holds trials of another campaign; the message names what differs.
        """
        self.path = Path(path)
        if campaign is None and not self.path.is_file():
            raise ModelError(f"{self.path}: no such trial database; make one with 'run'")
        try:
            stored = self._open() if campaign is None else self._open_or_make(campaign)
        except (sqlite3.Error, OSError) as error:
            raise ModelError(f"{self.path}: not usable as a trial database ({error})") from error
        self.content = json.loads(stored)
        if campaign is not None:
            require_same_work(
                self.path,
                _flat(self.content),
                _flat(campaign.content()),
                "take another --database, or the same settings",
            )
        self.hash = hashlib.sha256(json.dumps(self.content, sort_keys=True).encode()).hexdigest()

    def _open(self) -> str:
        """Connect for reading; the campaign's content."""
        self._connection = sqlite3.connect(_read_only(self.path), uri=True)
        stored = self._stored()
        if stored is None:
            raise ModelError(f"{self.path}: holds no campaign; make one with 'run'")
        return stored

    def _open_or_make(self, campaign: Campaign) -> str:
        """Connect for writing, what is missing made; the content of the campaign that it is of."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._connection = sqlite3.connect(self.path)
        stored = self._stored()
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.executescript(_SCHEMA)
        if stored is None:
            stored = json.dumps(campaign.content(), sort_keys=True)
            with self._connection:
                self._connection.execute(
                    "INSERT INTO configuration VALUES (1, ?, ?)", (campaign.hash, stored)
                )
        return stored

    def _stored(self) -> str | None:
        """The content of the file's campaign; None if there are no tables yet, or none in them.

        Raises:
            ModelError: if the tables are of another schema version.
        """
        if not self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
            return None
        found = self._connection.execute("PRAGMA user_version").fetchone()[0]
        if found != SCHEMA_VERSION:
            raise ModelError(
                f"{self.path}: schema version {found}; supported: {SCHEMA_VERSION}; "
                "make another database"
            )
        # The first databases of version 2 lack a column.
        with closing(sqlite3.connect(":memory:")) as wanted:
            wanted.executescript(_SCHEMA)
            for table in ("configuration", "trial"):
                here, there = (_columns(db, table) for db in (wanted, self._connection))
                if here != there:
                    raise ModelError(
                        f"{self.path}: table '{table}': columns {', '.join(sorted(here ^ there))} "
                        "missing or unknown; make another database"
                    )
        row = self._connection.execute("SELECT content FROM configuration").fetchone()
        return None if row is None else row[0]

    def close(self) -> None:
        """Close the file; further calls fail."""
        self._connection.close()

    def done(self) -> set[tuple[Pair, int]]:
        """Trials in the database: pair and repetition."""
        rows = self._connection.execute(f"SELECT {', '.join(_KEY)} FROM trial")
        return {(Pair(*row[:2]), row[2]) for row in rows}

    def add(self, pair: Pair, repetition: int, record: TrialRecord) -> None:
        """Commit one trial.

        Raises:
            ModelError: if that trial is there already, or the file cannot be written.
        """
        values: dict[str, Any] = {
            "configuration": self.hash,
            "state": pair.state,
            "action": pair.action,
            "repetition": repetition,
            "class": pair.number(trial_classes()),
            "seed": json.dumps([self.content["seed"], *spawn_key(pair, repetition)]),
            "noise": json.dumps(asdict(record.noise) if record.noise else {}),
        }
        values |= {name: getattr(record, name) for name in _PLAIN}
        for name in _VECTORS:
            values |= {
                f"{name}_{axis}": value
                for axis, value in zip("xyz", getattr(record, name), strict=True)
            }
        names, marks = ", ".join(values), ", ".join("?" * len(values))
        try:
            with self._connection:
                self._connection.execute(
                    f"INSERT INTO trial ({names}) VALUES ({marks})", list(values.values())
                )
        except sqlite3.Error as error:
            raise ModelError(f"{self.path}: a trial could not be written ({error})") from error

    def copy(self, path: Path) -> None:
        """Write a compact copy of the database as it is now, in one file.

        Args:
            path: of a file that does not exist yet, or is empty.

        Raises:
            ModelError: if it cannot be written.
        """
        try:
            self._connection.execute("VACUUM INTO ?", (str(path),))
        except sqlite3.Error as error:
            raise ModelError(f"{path}: a copy could not be written ({error})") from error

    def trials(self) -> Iterator[Trial]:
        """Every trial, in the order of its pair and repetition."""
        vectors = [f"{name}_{axis}" for name in _VECTORS for axis in "xyz"]
        rows = self._connection.execute(
            f"SELECT {', '.join((*_KEY, *_PLAIN, *vectors, 'noise'))} FROM trial "
            f"ORDER BY {', '.join(_KEY)}"
        )
        for row in rows:
            plain = dict(zip(_PLAIN, row[len(_KEY) :], strict=False))
            plain["outcome"] = Outcome(plain["outcome"])
            values, noise = row[len(_KEY) + len(_PLAIN) : -1], json.loads(row[-1])
            record = TrialRecord(
                **plain,
                turn=values[:3],
                displacement=values[3:],
                noise=Noise(**noise) if noise else None,
            )
            yield Trial(Pair(*row[:2]), row[2], record)


def _read_only(path: Path) -> str:
    """URI of a file that may lie where nothing can be written, not even SQLite's own aids."""
    immutable = "" if os.access(path.parent, os.W_OK) else "&immutable=1"
    return f"{path.absolute().as_uri()}?mode=ro{immutable}"


def _columns(database: sqlite3.Connection, table: str) -> set[str]:
    return {row[1] for row in database.execute(f"PRAGMA table_info({table})")}


def _flat(content: dict[str, Any]) -> dict[str, Any]:
    """A campaign's settings on one level, each of a trial's by its own name."""
    return {name: value for name, value in content.items() if name != "trial"} | content.get(
        "trial", {}
    )
