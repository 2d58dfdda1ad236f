"""The trial database: SQLite, append-only, one row a trial (the truth that task data come from).

Nothing in a file is believed: its tables, the hash of its campaign and every row are checked when
they are read (`schema`, `rows`), and what disagrees is refused by name. Nothing is mended either:
a refused file stays as it is.
"""

import hashlib
import json
import os
import sqlite3
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from diagrams.trials.record import Pair, Trial, TrialConfig, TrialRecord
from diagrams.trials.rows import KEY, require_row, to_row, to_trial
from diagrams.trials.schema import SCHEMA_VERSION, stored_version, tables
from diagrams.trials.writing import WriterLock
from irl.identity import require_same_work
from models.errors import ModelError

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
        return json.loads(json.dumps({**asdict(self), "trial": self.trial.content()}))

    @property
    def hash(self) -> str:
        """SHA-256 of the content."""
        return _hash(json.dumps(self.content(), sort_keys=True))


class TrialDatabase:
    """Trials of one campaign on disk; every committed trial survives a kill.

    One process at a time may write; any number may read meanwhile.
    """

    def __init__(self, path: Path, campaign: Campaign | None = None) -> None:
        """Open or create a database.

        Args:
            path: of the file; its folder is made if missing.
            campaign: to record trials under; None opens an existing database for reading.

        Raises:
            ModelError: if the file is not a trial database, is damaged, of a schema version that
                cannot be read (or, to record trials, not added to), is missing and ``campaign``
                is None, is being written by another process, or cannot be written.
            InputError: if it holds trials of another campaign; the message names what differs.
        """
        self._writer: WriterLock | None = None
        self._connection: sqlite3.Connection | None = None
        self.path = Path(path)
        with suppress(OSError):
            if not stat.S_ISREG(self.path.stat().st_mode):
                raise ModelError(f"{self.path}: is not a regular file; wanted a trial database")
        if campaign is None and not self.path.is_file():
            raise ModelError(f"{self.path}: no such trial database; make one with 'run'")
        try:
            with self._reading():
                text = self._open() if campaign is None else self._open_or_make(campaign)
            self.content = _campaign_content(text, self.path)
            if campaign is not None:
                require_same_work(
                    self.path,
                    _flat(self.content),
                    _flat(campaign.content()),
                    "take another --database, or the same settings",
                )
        except BaseException:
            self.close()
            raise
        self.hash = _hash(text)

    def __del__(self) -> None:
        """Close the file, as its connection does by itself."""
        self.close()

    def _open(self) -> str:
        """Connect for reading; the campaign's content."""
        self._connection = sqlite3.connect(_read_only(self.path), uri=True)
        if stored_version(self._connection, self.path) is None:
            raise ModelError(f"{self.path}: holds no campaign; make one with 'run'")
        return self._stored(self._connection)

    def _open_or_make(self, campaign: Campaign) -> str:
        """Connect for writing, what is missing made; the content of the campaign that it is of."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._writer = WriterLock(self.path)
        self._connection = sqlite3.connect(self.path)
        version = stored_version(self._connection, self.path)
        if version is not None and version != SCHEMA_VERSION:
            raise ModelError(
                f"{self.path}: schema version {version} is read, but not added to; "
                "take another --database"
            )
        if version is not None:
            text = self._stored(self._connection)
        self._connection.execute("PRAGMA journal_mode = WAL")
        if version is None:
            text = json.dumps(campaign.content(), sort_keys=True)
            # Whole or not at all, so that who looks meanwhile sees no part of it.
            with self._connection:
                self._connection.execute("BEGIN IMMEDIATE")
                for statement in tables(SCHEMA_VERSION):
                    self._connection.execute(statement)
                self._connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
                row = (1, campaign.hash, text)
                self._connection.execute("INSERT INTO configuration VALUES (?, ?, ?)", row)
        return text

    def _stored(self, connection: sqlite3.Connection) -> str:
        """Content of the file's campaign, as text whose hash is the one stored.

        Raises:
            ModelError: if there is no campaign, or its hash is another.
        """
        row = connection.execute("SELECT hash, content FROM configuration").fetchone()
        if row is None:
            trials = connection.execute("SELECT count(*) FROM trial").fetchone()[0]
            raise ModelError(
                f"{self.path}: table 'configuration' is empty, holds no campaign, "
                f"though there are {trials} trials; wanted one row"
            )
        stored, text = row
        if not isinstance(text, str) or stored != _hash(text):
            raise ModelError(
                f"{self.path}: table 'configuration': column 'hash' is {stored!r:.70}, which is "
                "not the hash of column 'content'"
            )
        return text

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Tell what SQLite and the disk complain of with the file's name."""
        try:
            yield
        except (sqlite3.Error, OSError, UnicodeError) as error:
            told = " ".join(str(error).split())[:200]
            raise ModelError(f"{self.path}: not usable as a trial database ({told})") from error

    def _connected(self) -> sqlite3.Connection:
        if self._connection is None:
            raise ModelError(f"{self.path}: was closed")
        return self._connection

    def close(self) -> None:
        """Close the file; further calls fail."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.release()

    def done(self) -> set[tuple[Pair, int]]:
        """Trials in the database: pair and repetition.

        Raises:
            ModelError: as `trials`.
        """
        return {(pair, repetition) for pair, repetition, _ in self.trials()}

    def add(self, pair: Pair, repetition: int, record: TrialRecord) -> None:
        """Commit one trial.

        Raises:
            ModelError: if that trial is there already, cannot be a trial of this campaign, or the
                file cannot be written.
        """
        connection = self._connected()
        row = to_row(self.hash, self.content["seed"], pair, repetition, record)
        place = f"{self.path}: a trial could not be written"
        try:
            require_row(row, self.hash, self.content["seed"])
            names, marks = ", ".join(row), ", ".join("?" * len(row))
            with connection:
                connection.execute(
                    f"INSERT INTO trial ({names}) VALUES ({marks})", list(row.values())
                )
        except (sqlite3.Error, ModelError) as error:
            raise ModelError(f"{place} ({error})") from error

    def copy(self, path: Path) -> None:
        """Write a compact copy of the database as it is now, in one file.

        Args:
            path: of a file that does not exist yet, or is empty.

        Raises:
            ModelError: if it cannot be written.
        """
        try:
            self._connected().execute("VACUUM INTO ?", (str(path),))
        except sqlite3.Error as error:
            raise ModelError(f"{path}: a copy could not be written ({error})") from error

    def trials(self) -> Iterator[Trial]:
        """Every trial, in the order of its pair and repetition.

        Raises:
            ModelError: if a row cannot be a trial of this campaign, or its digest is not its own;
                names the row and the column.
        """
        with self._reading():
            rows = self._connected().execute(
                f"SELECT rowid, * FROM trial ORDER BY {', '.join(KEY)}"
            )
            names = [column[0] for column in rows.description][1:]
            for number, *values in rows:
                row = dict(zip(names, values, strict=True))
                try:
                    require_row(row, self.hash, self.content["seed"])
                except ModelError as error:
                    place = f"{self.path}: table 'trial': row {number}"
                    raise ModelError(f"{place}: {error}") from None
                yield to_trial(row)


def _campaign_content(text: str, path: Path) -> dict[str, Any]:
    """A campaign's settings out of its stored text, whose names may be of another release.

    Raises:
        ModelError: if they are no campaign's.
    """
    place = f"{path}: table 'configuration': column 'content'"
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ModelError(f"{place}: no JSON ({error})") from error
    kinds = {
        **{"trial": dict, "seed": int, "description": str, "drake": str},
        **{"rig": str, "reachability_map": str},
    }
    for name, kind in kinds.items():
        value = content.get(name) if isinstance(content, dict) else None
        if type(value) is not kind:
            raise ModelError(f"{place}: {name!r} is {value!r:.40}; wanted {kind.__name__}")
    if content["seed"] < 0 or content["rig"] not in (FLOATING, ARM):
        raise ModelError(
            f"{place}: seed {content['seed']}, rig {content['rig']!r}; wanted 0 or more, and "
            f"{FLOATING} or {ARM}"
        )
    return content


def _read_only(path: Path) -> str:
    """URI of a file that may lie where nothing can be written, not even SQLite's own aids.

    What a killed writer left in a log beside it counts; then SQLite needs them.
    """
    log = path.with_name(f"{path.name}-wal")
    alone = not os.access(path.parent, os.W_OK) and not (log.exists() and log.stat().st_size)
    return f"{path.absolute().as_uri()}?mode=ro{'&immutable=1' if alone else ''}"


def _flat(content: dict[str, Any]) -> dict[str, Any]:
    """A campaign's settings on one level, each of a trial's by its own name."""
    return {name: value for name, value in content.items() if name != "trial"} | content.get(
        "trial", {}
    )


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()
