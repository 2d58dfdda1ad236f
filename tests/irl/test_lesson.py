"""The lesson file: kept whole, added to only, and refused by name where it is not what it was."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import (
    KINDS,
    Advised,
    Answered,
    Asked,
    Began,
    Edit,
    Outcome,
    Round,
    Undo,
    from_plain,
    to_plain,
)

BEGAN = Began(
    "a" * 64, {"method": "planning"}, {"numpy": "1"}, [[0, 0, 3, 1, "human"]], [[0, 1, 2]]
)
ASKED = Asked(3, "start", 0.0, -1, 1, 0, None, "learn", "t0")
ANSWERED = Answered(3, 1, 1, 0, None, 2.5, 1)


@pytest.fixture
def lesson(tmp_path):
    with Lesson.begin(tmp_path / "lesson.db", BEGAN) as made:
        yield made


def test_what_was_added_is_there_when_it_is_opened_again(lesson):
    said = [ASKED, ANSWERED, Outcome(3, 4), Advised("a ∩ b", "", [1], [2]), Round(0, 4, True)]
    lesson.append(said[0])
    lesson.append(said[1:3], token="t0")
    lesson.append(said[3:])
    lesson.close()
    with Lesson(lesson.path) as again:
        assert again.events == [BEGAN, *said]
        assert again.used("t0") and not again.used("t1")
        assert len(again.times) == 6 and again.times == sorted(again.times)
        assert again.initial.pairs == [(3, 1)] and again.initial.ends.tolist() == [[0, 1, 2]]


def test_what_comes_under_a_token_again_is_nothing_new_also_after_a_restart(lesson):
    assert lesson.append(ANSWERED, token="t0") == 2
    assert lesson.append(ANSWERED, token="t0") is None
    lesson.close()
    with Lesson(lesson.path) as again:
        assert again.append([ANSWERED, Outcome(2, 4)], token="t0") is None
        assert len(again.events) == 2


def test_it_writes_ahead_and_waits_for_the_disk(lesson):
    connection = lesson._connection
    assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    assert connection.execute("PRAGMA synchronous").fetchone() == (2,)  # FULL


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE event SET at = 0 WHERE number = 2",
        "DELETE FROM event WHERE number = 2",
        "INSERT OR REPLACE INTO event VALUES (2, 0.0, 'undo', '{\"of\": 1}', NULL, '')",
        "INSERT INTO event VALUES (9, 0.0, 'undo', '{\"of\": 1}', NULL, '')",
    ],
)
def test_nothing_is_changed_or_taken_out_by_whoever_writes_sql(lesson, statement):
    lesson.append(ANSWERED)
    lesson.close()
    with (
        closing(sqlite3.connect(lesson.path)) as connection,
        pytest.raises(sqlite3.IntegrityError),
        connection,
    ):
        connection.execute(statement)
    with Lesson(lesson.path) as again:
        assert again.events == [BEGAN, ANSWERED]


def changed(path: Path, *statements: str) -> None:
    """Change a lesson as somebody does who takes its triggers away and puts them back."""
    with closing(sqlite3.connect(path)) as connection, connection:
        kept = connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'")
        triggers = kept.fetchall()
        for name, _ in triggers:
            connection.execute(f"DROP TRIGGER {name}")
        for statement in statements:
            connection.execute(statement)
        for _, sql in triggers:
            connection.execute(sql)


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE event SET content = replace(content, '\"action\":1', '\"action\":2')",
        "UPDATE event SET at = at + 1 WHERE number = 2",
        "UPDATE event SET token = 'other' WHERE number = 2",
        "DELETE FROM event WHERE number = 2",
        "DELETE FROM event",
        "UPDATE event SET kind = 'undo' WHERE number = 3",
        "INSERT INTO event VALUES (4, 0.0, 'undo', '{\"of\": 2}', NULL, 'deadbeef')",
        "INSERT INTO event VALUES (4, 0.0, X'00', X'FF', NULL, 'deadbeef')",
        "DROP TABLE event",
        "CREATE TABLE more (x)",
        "PRAGMA user_version = 2",
        "PRAGMA application_id = 1",
    ],
)
def test_a_lesson_that_was_changed_is_refused_by_name_and_left_as_it_is(lesson, statement):
    lesson.append([ANSWERED, ANSWERED])
    lesson.close()
    if statement == "DROP TABLE event":
        with closing(sqlite3.connect(lesson.path)) as connection, connection:
            connection.execute(statement)
    else:
        changed(lesson.path, statement)
    before = lesson.path.read_bytes()
    with pytest.raises(InputError, match=r"^[^\n]+$") as refused:
        Lesson(lesson.path)
    assert refused.value.place.startswith(str(lesson.path))
    assert lesson.path.read_bytes() == before
    assert {p.name for p in lesson.path.parent.iterdir()} == {"lesson.db"}


@pytest.mark.parametrize(
    "content",
    [b"", b"{}", b"SQLite format 3\0 and nothing", bytes(4096), "other", "shorter", "torn"],
    ids=["empty", "json", "header", "zeros", "other", "shorter", "torn"],
)
@pytest.mark.parametrize("writable", [True, False])
def test_what_is_no_whole_lesson_is_refused_and_left_as_it_is(lesson, content, writable):
    path = lesson.path
    for _ in range(60):
        lesson.append(ANSWERED)
    lesson.close()
    whole = path.read_bytes()
    if content == "other":
        path.unlink()
        with closing(sqlite3.connect(path)) as connection, connection:
            connection.execute("CREATE TABLE trial (x)")
    elif content == "shorter":
        path.write_bytes(whole[: len(whole) // 2])
    elif content == "torn":
        path.write_bytes(whole[:-4096] + bytes(4096))
    else:
        path.write_bytes(content)
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"^[^\n]+$") as refused:
        Lesson(path, writable=writable)
    assert refused.value.place.startswith(str(path))
    assert path.read_bytes() == before


def test_a_lesson_never_takes_the_place_of_a_file(lesson, tmp_path):
    for path in (lesson.path, tmp_path / "notes.txt", tmp_path):
        if path.name == "notes.txt":
            path.write_text("mine")
        with pytest.raises(InputError, match="there is a file of that name"):
            Lesson.begin(path, BEGAN)
    assert (tmp_path / "notes.txt").read_text() == "mine"
    with pytest.raises(InputError, match="no such lesson"):
        Lesson(tmp_path / "none.db")
    with pytest.raises(InputError, match="not a regular file"):
        Lesson(tmp_path)


def test_one_process_adds_and_others_read_meanwhile(lesson):
    lesson.append(ANSWERED)
    with pytest.raises(InputError, match="another process is adding to it"):
        Lesson(lesson.path)
    with Lesson(lesson.path, writable=False) as reader:
        assert reader.events == [BEGAN, ANSWERED]
        with pytest.raises(InputError):
            reader.append(ANSWERED)
    lesson.append(ANSWERED)


def test_a_lesson_is_read_where_nothing_can_be_written(lesson, monkeypatch):
    lesson.append(ANSWERED)
    lesson.close()
    before = {p.name for p in lesson.path.parent.iterdir()}
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with Lesson(lesson.path, writable=False) as reader:
        assert reader.events == [BEGAN, ANSWERED]
        assert {p.name for p in lesson.path.parent.iterdir()} == before == {"lesson.db"}


def test_a_lesson_about_another_task_is_refused_by_both_hashes(lesson):
    lesson.require_task("a" * 64)
    with pytest.raises(InputError, match=r"'aaaaaaaaaaaa'…, not about 'bbbbbbbbbbbb'"):
        lesson.require_task("b" * 64)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_event_comes_back_as_it_was_and_is_held_to_its_fields(kind):
    whole = {
        "began": BEGAN,
        "asked": ASKED,
        "answered": ANSWERED,
        "edit": Edit(2, {"action": 3}),
        "undo": Undo(2),
    }
    if kind not in whole:
        return
    name, values = to_plain(whole[kind])
    assert from_plain(name, json.loads(json.dumps(values))) == whole[kind]
    for broken in ({}, values | {"more": 1}, values | {next(iter(values)): object()}):
        with pytest.raises(InputError):
            from_plain(kind, broken)


KILLED = """
import sys
from pathlib import Path
from irl.lesson import Lesson
from irl.lesson_events import Answered
with Lesson(Path(sys.argv[1])) as lesson:
    for k in range(10_000):
        lesson.append(Answered(k, 1, k, 0), token=f"q{k}")
        print(k, flush=True)
"""


def test_what_append_returned_from_survives_a_kill(lesson):
    path = lesson.path
    lesson.close()
    written = 0
    for wait in (0.0, 0.01, 0.03):
        child = subprocess.Popen(
            [
                sys.executable,
                "-c",
                KILLED.replace("range(10_000)", f"range({written}, 10_000)"),
                path,
            ],
            stdout=subprocess.PIPE,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
        )
        child.stdout.readline()
        time.sleep(wait)
        child.send_signal(signal.SIGKILL)
        told = child.communicate()[0].split()
        with Lesson(path) as again:
            answers = [event.state for event in again.events[1:]]
        assert answers == list(range(len(answers)))  # none lost, none doubled
        assert len(answers) >= int(told[-1]) + 1 if told else True
        written = len(answers)
