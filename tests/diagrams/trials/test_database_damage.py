"""Damaged trial databases: told in one line by name, never believed, never altered by a look.

What is true is known here independently: the rows that were written. A damaged file either is
refused, or gives exactly those rows (a flip may hit what no row is made of).
"""

import hashlib
import json
import os
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing, suppress
from dataclasses import replace

import numpy as np
import pytest

from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.record import Noise, Outcome, Pair, TrialConfig, TrialRecord
from irl.errors import InputError
from models.errors import ModelError
from models.task.spaces import LOST, N_FREE

CAMPAIGN = Campaign(TrialConfig(), seed=0, description="d", drake="1")
OTHER = replace(CAMPAIGN, seed=1)
N_ROWS = 120
NUMBERS = ("state", "action", "repetition", "class", "next_state", "turn_x", "displacement_z")
NUMBERS += ("snap_angle", "drift", "slip", "in_hand_rotation", "opening", "speed", "draws", "cpu_s")
TEXTS = ("configuration", "seed", "outcome", "noise", "fault")


def record(rng):
    x, y, z = rng.normal(0, 0.01, 3).tolist()
    noise = Noise(*rng.normal(0, 0.01, 6).tolist(), friction=0.7, mass=0.1)
    state = [48, LOST, N_FREE + 7][rng.integers(3)]
    outcome = Outcome.HELD if state == N_FREE + 7 else Outcome.FREE
    turn = tuple(rng.normal(0, 0.5, 3).tolist())
    drift = float(np.hypot(x, y))
    return TrialRecord(outcome, state, turn, (x, y, z), drift=drift, noise=noise, cpu_s=0.5)


def fill(path, campaign, seed=0):
    rng = np.random.default_rng(seed)
    with closing(TrialDatabase(path, campaign)) as database:
        for number in range(N_ROWS):
            database.add(Pair(9000, 54), number, record(rng))


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A sound database of each of two campaigns, and what a killed writer leaves of the first."""
    folder = tmp_path_factory.mktemp("sound")
    fill(folder / "t.db", CAMPAIGN)
    fill(folder / "other.db", OTHER, seed=1)
    (folder / "killed").mkdir()
    script = (
        "import os, sys; from tests.diagrams.trials.test_database_damage import *;"
        "path = sys.argv[1]; TrialDatabase.close = lambda self: None;"
        "fill(path, CAMPAIGN); os._exit(1)"
    )
    killed = folder / "killed" / "t.db"
    subprocess.run([sys.executable, "-c", script, str(killed)], check=False)
    assert killed.with_name("t.db-wal").stat().st_size > 0
    return folder


def change(path, *statements):
    with closing(sqlite3.connect(path)) as connection, suppress(sqlite3.Error), connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        for statement in statements:
            connection.execute(*statement if isinstance(statement, tuple) else (statement,))


def definition(path):
    """How the table of trials is defined."""
    with closing(sqlite3.connect(path)) as connection:
        query = "SELECT sql FROM sqlite_master WHERE name = 'trial'"
        return connection.execute(query).fetchone()[0]


def in_place(path, sql):
    """Change what a table's definition says, but nothing else."""
    change(path, "PRAGMA writable_schema = ON", sql)


def flip_bytes(path, rng):
    data = bytearray(path.read_bytes())
    for _ in range(rng.integers(1, 9)):
        data[rng.integers(len(data))] ^= int(rng.integers(1, 256))
    path.write_bytes(data)


def flip_header(path, rng):
    data = bytearray(path.read_bytes())
    data[rng.integers(100)] ^= 1 << int(rng.integers(8))
    path.write_bytes(data)


def zero_page(path, rng):
    data = bytearray(path.read_bytes())
    page = int(rng.integers(len(data) // 4096))
    data[4096 * page : 4096 * (page + 1)] = bytes(4096)
    path.write_bytes(data)


def swap_pages(path, rng):
    data = bytearray(path.read_bytes())
    a, b = (4096 * int(page) for page in rng.choice(len(data) // 4096, 2, replace=False))
    data[a : a + 4096], data[b : b + 4096] = data[b : b + 4096], data[a : a + 4096]
    path.write_bytes(data)


def truncate(path, rng):
    os.truncate(path, int(rng.integers(path.stat().st_size)))


def drop_column(path, rng):
    change(path, f"ALTER TABLE trial DROP COLUMN {rng.choice(NUMBERS[5:])}")


def rename_column(path, rng):
    change(path, f"ALTER TABLE trial RENAME COLUMN {rng.choice(NUMBERS + TEXTS)} TO renamed")


def add_column(path, rng):
    del rng
    change(path, "ALTER TABLE trial ADD COLUMN more REAL")


def number_out_of_range(path, rng):
    value = float(rng.choice([-1e9, 1e9, -2.0, 1e308, np.inf]))
    change(path, (f"UPDATE trial SET {rng.choice(NUMBERS)} = ? WHERE rowid = 7", (value,)))


def plausible_number(path, rng):
    value = float(rng.uniform(0, 0.01))
    change(path, (f"UPDATE trial SET {rng.choice(NUMBERS[5:])} = ? WHERE rowid = 7", (value,)))


def another_state(path, rng):
    change(path, f"UPDATE trial SET next_state = {rng.integers(N_FREE)} WHERE next_state = 48")


def null(path, rng):
    """NULL where none may be: the definition, too, says NULL until it is put back."""
    column = rng.choice(NUMBERS + TEXTS)
    sql = definition(path)
    free = sql.replace("NOT NULL", "")
    set_sql = "UPDATE sqlite_master SET sql = ? WHERE name = 'trial'"
    in_place(path, (set_sql, (free,)))
    change(path, f"UPDATE trial SET {column} = NULL WHERE rowid = 5")
    in_place(path, (set_sql, (sql,)))


def text_for_number(path, rng):
    text = str(rng.choice(["many", "", "nan", "1e400", "0x10"]))
    change(path, (f"UPDATE trial SET {rng.choice(NUMBERS)} = ? WHERE rowid = 9", (text,)))


def bytes_for_anything(path, rng):
    value = bytes(rng.integers(0, 256, 12, dtype=np.uint8))
    column = rng.choice(NUMBERS + TEXTS)
    change(path, (f"UPDATE trial SET {column} = ? WHERE rowid = 9", (value,)))


def text_for_text(path, rng):
    texts = ["", "{}", "[0, 1, 2, 3]", "held", "nought", '{"x": NaN}', "[" * 100_000, "\ud7ff"]
    value = str(rng.choice(texts))
    change(path, (f"UPDATE trial SET {rng.choice(TEXTS)} = ?||'' WHERE rowid = 3", (value,)))


def merge_other_campaign(path, rng):
    other = str(path.parent / "other.db")
    name = "replace(configuration, configuration, (SELECT hash FROM configuration))"
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("ATTACH ? AS other", (other,))
        columns = [row[1] for row in connection.execute("PRAGMA table_info(trial)")]
        # Some merge with the campaign's name replaced; of these repetitions are moved on.
        if rng.integers(2):
            columns = [name if c == "configuration" else c for c in columns]
        columns = ["repetition + 1000" if c == "repetition" else c for c in columns]
        connection.execute(f"INSERT INTO trial SELECT {', '.join(columns)} FROM other.trial")


def duplicate_keys(path, rng):
    row = int(rng.integers(1, N_ROWS))
    sql = definition(path)
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("ALTER TABLE trial RENAME TO old")
        connection.execute(sql[: sql.index("UNIQUE")].rstrip().rstrip(",") + ")")
        connection.execute("INSERT INTO trial SELECT * FROM old")
        connection.execute("INSERT INTO trial SELECT * FROM old WHERE rowid = ?", (row,))
        connection.execute("DROP TABLE old")


def other_content(path, rng):
    texts = ['{"seed": 3}', "", "[]", "no JSON", "[" * 100_000, json.dumps(OTHER.content())]
    text = str(rng.choice(texts))
    column = rng.choice(["content", "hash"])
    change(path, (f"UPDATE configuration SET {column} = ?", (text,)))


def hashed_nonsense(path, rng):
    text = str(rng.choice(["[]", "3", '{"seed": -1}', '{"seed": "0"}', "null", "NaN"]))
    name = hashlib.sha256(text.encode()).hexdigest()
    change(path, ("UPDATE configuration SET content = ?, hash = ?", (text, name)))


def no_campaign(path, rng):
    del rng
    change(path, "DELETE FROM configuration")


def another_version(path, rng):
    change(path, f"PRAGMA user_version = {rng.choice([0, 1, 2, 4, -1, 2**30])}")


def more_tables(path, rng):
    more = ["CREATE TABLE more (x)", "CREATE VIEW more AS SELECT 1"]
    more.append("CREATE INDEX i ON trial(slip)")
    more.append("CREATE TRIGGER t AFTER INSERT ON trial BEGIN SELECT 1; END")
    change(path, str(rng.choice(more)))


def foreign_file(path, rng):
    path.unlink()
    version = int(rng.choice([0, 2, 3, 7]))
    change(path, "CREATE TABLE books (title TEXT)", f"PRAGMA user_version = {version}")


def foreign_empty_file(path, rng):
    path.unlink()
    change(path, f"PRAGMA user_version = {rng.integers(1, 9)}")


def foreign_same_names(path, rng):
    path.unlink()
    version = rng.choice([2, 3])
    change(
        path,
        "CREATE TABLE trial (judge TEXT)",
        "CREATE TABLE configuration (id, hash, content)",
        f"PRAGMA user_version = {version}",
    )


def empty_file(path, rng):
    del rng
    path.write_bytes(b"")


def no_file(path, rng):
    path.unlink()
    kind = rng.integers(3)
    if kind == 0:
        path.mkdir()
    elif kind == 1:
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")


def noise_file(path, rng):
    path.write_bytes(rng.bytes(int(rng.integers(1, 50_000))))


def log_of_another(path, rng):
    """A log that a killed writer of another database left, beside this one."""
    shutil.copy(path.parent / "killed" / "t.db-wal", path.with_name("t.db-wal"))
    if rng.integers(2):
        log = bytearray(path.with_name("t.db-wal").read_bytes())
        log[rng.integers(len(log))] ^= 255
        path.with_name("t.db-wal").write_bytes(log)


def log_left_behind(path, rng):
    """A killed writer's file and log, perhaps damaged."""
    for name in ("t.db", "t.db-wal"):
        shutil.copy(path.parent / "killed" / name, path.with_name(name))
    if rng.integers(2):
        log = path.with_name("t.db-wal")
        os.truncate(log, int(rng.integers(log.stat().st_size)))


def log_alone(path, rng):
    """The file of a killed writer without the log that has its rows."""
    del rng
    shutil.copy(path.parent / "killed" / "t.db", path)


DAMAGES = (
    *(flip_bytes, flip_header, zero_page, swap_pages, truncate, drop_column, rename_column),
    *(add_column, number_out_of_range, plausible_number, another_state, null, text_for_number),
    *(bytes_for_anything, text_for_text, merge_other_campaign, duplicate_keys, other_content),
    *(hashed_nonsense, no_campaign, another_version, more_tables, foreign_file),
    *(foreign_empty_file, foreign_same_names, empty_file, no_file, noise_file, log_of_another),
    *(log_left_behind, log_alone),
)
ALWAYS_REFUSED = {
    *(truncate, drop_column, rename_column, add_column, null, hashed_nonsense, no_campaign),
    *(duplicate_keys, merge_other_campaign, more_tables, foreign_file, foreign_empty_file),
    *(foreign_same_names, empty_file, no_file, noise_file, plausible_number, another_state),
}


def trials_or_refusal(path, campaign):
    """What a look gives, or the refusal; any other exception is a defect."""
    try:
        with closing(TrialDatabase(path, campaign)) as database:
            return list(database.trials())
    except (ModelError, InputError) as error:
        return error


def damage_and_look(folder, sound, number):
    """Damage one file as its number says; it is refused, or its rows are among those written."""
    rng = np.random.default_rng([12, number])
    damage = DAMAGES[number % len(DAMAGES)]
    shutil.copytree(sound, folder)
    path = folder / "t.db"
    truth = trials_or_refusal(path, None)
    assert len(truth) == N_ROWS
    damage(path, rng)
    before = path.read_bytes() if path.is_file() and path.stat().st_size < 10**8 else None
    look = trials_or_refusal(path, None)
    if isinstance(look, Exception):
        assert str(look).startswith(str(path)) and "\n" not in str(look), (damage, look)
    else:
        assert damage not in ALWAYS_REFUSED, (damage, number)
        # A log cut short loses what it held; nothing else, and no row is another.
        assert look == truth[: len(look)] and (len(look) == N_ROWS or "log" in damage.__name__)
    if before is not None:
        assert path.read_bytes() == before, damage
    # A writer believes no more than a reader, and makes nothing in a file of somebody else's.
    work = trials_or_refusal(path, CAMPAIGN)
    if isinstance(look, Exception) and damage is not empty_file and "log" not in damage.__name__:
        assert isinstance(work, Exception), (damage, number)
        assert before is None or path.read_bytes() == before, (damage, number)
    shutil.rmtree(folder)
    return isinstance(look, Exception)


def test_each_kind_of_damage_is_refused_or_harmless(tmp_path, sound):
    for number in range(2 * len(DAMAGES)):
        damage_and_look(tmp_path / "d", sound, number)


@pytest.mark.soak
def test_500_damaged_databases(tmp_path, sound):
    refused = sum(damage_and_look(tmp_path / "d", sound, number) for number in range(500))
    print(f"{refused} of 500 refused, the others gave the rows that were written")
    assert refused > 400
