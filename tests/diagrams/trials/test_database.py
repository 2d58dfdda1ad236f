import hashlib
import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.record import Noise, Outcome, Pair, TrialConfig, TrialRecord, spawn_key
from irl.errors import InputError
from models.errors import ModelError
from models.task.trial_classes import trial_classes

FORMATS = Path(__file__).parents[2] / "data" / "formats" / "trial_database"
CAMPAIGN = Campaign(TrialConfig(), seed=0, description="d", drake="1")
PAIR = Pair(9000, 54)
NOISE = Noise(0.1, 0.0, 1 / 3, 0.0, 0.0, 0.0, 0.8, 0.1)
RECORD = TrialRecord(
    Outcome.FREE,
    next_state=48,
    turn=(0.1, 0.2, 1 / 3),
    displacement=(1e-3, 0.0, -0.03),
    drift=1e-3,
    noise=NOISE,
    draws=2,
)


def test_what_goes_in_comes_out_to_the_last_bit(tmp_path):
    fault = TrialRecord(Outcome.FAULT, fault="the solver gave up\nTraceback: …\n  line 1")
    with closing(TrialDatabase(tmp_path / "t.db", CAMPAIGN)) as database:
        database.add(PAIR, 4, RECORD)
        database.add(PAIR, 5, fault)
    database = TrialDatabase(tmp_path / "t.db")
    assert list(database.trials()) == [(PAIR, 4, RECORD), (PAIR, 5, fault)]
    assert fault.reason == "the solver gave up"
    assert database.done() == {(PAIR, 4), (PAIR, 5)}


def test_a_trial_is_taken_once(tmp_path):
    database = TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    database.add(PAIR, 0, RECORD)
    with pytest.raises(ModelError, match="could not be written"):
        database.add(PAIR, 0, RECORD)
    assert len(list(database.trials())) == 1


def test_another_campaign_is_refused_by_what_changed(tmp_path):
    TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    other = replace(CAMPAIGN, seed=1, trial=TrialConfig(tilt_sd=0.5))
    with pytest.raises(InputError) as error:
        TrialDatabase(tmp_path / "t.db", other)
    assert str(error.value) == (
        f"{tmp_path / 't.db'}: kept by other work, differing in seed (0 there, 1 here), "
        "tilt_sd (0.02 there, 0.5 here); take another --database, or the same settings"
    )
    TrialDatabase(tmp_path / "t.db", replace(CAMPAIGN)).close()


def test_a_setting_counts_where_its_solver_asks_for_it(tmp_path):
    finer = replace(TrialConfig(), landing_accuracy=1e-7, restitution=(0.1, 0.2))

    def hashes(solver):
        both = (replace(trial, solver=solver) for trial in (TrialConfig(), finer))
        return {replace(CAMPAIGN, trial=trial).hash for trial in both}

    assert len(hashes("discrete")) == 1
    assert len(hashes("cenic")) == 2
    assert not hashes("discrete") & hashes("cenic")


def test_a_row_names_its_class_and_seed(tmp_path):
    TrialDatabase(tmp_path / "t.db", CAMPAIGN).add(PAIR, 4, RECORD)
    row = sqlite3.connect(tmp_path / "t.db").execute("SELECT class, seed FROM trial").fetchone()
    number, seed = row[0], json.loads(row[1])
    assert number == trial_classes().number(PAIR.state, PAIR.action)
    assert (seed[0], tuple(seed[1:])) == (CAMPAIGN.seed, spawn_key(PAIR, 4))


def test_a_copy_holds_the_same_in_one_file_that_reading_leaves_alone(tmp_path):
    original = TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    original.add(PAIR, 0, RECORD)
    folder = tmp_path / "copy"
    folder.mkdir()
    original.copy(folder / "c.db")
    with pytest.raises(ModelError, match=r"c\.db"):
        original.copy(folder / "c.db")
    before = (folder / "c.db").read_bytes()
    copy = TrialDatabase(folder / "c.db")
    assert list(copy.trials()) == [(PAIR, 0, RECORD)]
    assert (copy.content, copy.hash) == (original.content, original.hash)
    copy.close()
    assert [path.name for path in folder.iterdir()] == ["c.db"]
    assert (folder / "c.db").read_bytes() == before


def test_a_database_that_cannot_be_written_is_named_and_keeps_what_it_has(tmp_path):
    database = TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    database.add(PAIR, 0, RECORD)
    # What SQLite says where file or disk is read-only, whoever asks.
    database._connection.execute("PRAGMA query_only = ON")
    with pytest.raises(ModelError, match=r"t\.db: a trial could not be written \(.*readonly"):
        database.add(PAIR, 1, RECORD)
    assert list(database.trials()) == [(PAIR, 0, RECORD)]
    with pytest.raises(ModelError, match=r"t\.db/t\.db: not usable"):
        TrialDatabase(tmp_path / "t.db" / "t.db", CAMPAIGN)


def test_a_new_database_makes_its_folder_and_an_absent_one_does_not(tmp_path):
    TrialDatabase(tmp_path / "new" / "folder" / "t.db", CAMPAIGN).close()
    assert TrialDatabase(tmp_path / "new" / "folder" / "t.db").content == CAMPAIGN.content()
    with pytest.raises(ModelError, match="no such trial database"):
        TrialDatabase(tmp_path / "other" / "t.db")
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize("campaign", [CAMPAIGN, None])
def test_tables_of_another_version_are_refused(tmp_path, campaign):
    TrialDatabase(tmp_path / "t.db", CAMPAIGN).close()
    connection = sqlite3.connect(tmp_path / "t.db")
    connection.execute("PRAGMA user_version = 1")
    connection.close()
    with pytest.raises(ModelError, match=r"t\.db: schema version 1; supported: 2, 3"):
        TrialDatabase(tmp_path / "t.db", campaign)


def test_a_file_whose_making_was_cut_short_holds_no_campaign_and_can_be_gone_on_with(tmp_path):
    (tmp_path / "t.db").touch()
    with pytest.raises(ModelError, match=r"t\.db: holds no campaign"):
        TrialDatabase(tmp_path / "t.db")
    TrialDatabase(tmp_path / "t.db", CAMPAIGN).close()
    assert TrialDatabase(tmp_path / "t.db").content == CAMPAIGN.content()


@pytest.mark.parametrize("content", [b"not a database, but long enough to be one" * 30, None])
def test_what_is_not_a_database_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "t.db").write_bytes(content)
    with pytest.raises(ModelError, match=r"t\.db"):
        TrialDatabase(tmp_path / "t.db")


def test_a_second_writer_is_told_so_and_a_reader_is_not(tmp_path):
    first = TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    with pytest.raises(ModelError, match=r"t\.db: another process is writing there"):
        TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    first.add(PAIR, 0, RECORD)
    assert len(list(TrialDatabase(tmp_path / "t.db").trials())) == 1
    first.close()
    TrialDatabase(tmp_path / "t.db", CAMPAIGN).close()
    assert [path.name for path in tmp_path.iterdir()] == ["t.db"]


def test_a_database_without_digests_is_read_as_it_is_but_not_added_to(tmp_path):
    before = (FORMATS / "2" / "trials.db").read_bytes()
    (tmp_path / "t.db").write_bytes(before)
    old = TrialDatabase(tmp_path / "t.db")
    assert len(list(old.trials())) > 0 and "seed" in old.content
    old.close()
    with pytest.raises(ModelError, match="schema version 2 is read, but not added to"):
        TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    assert (tmp_path / "t.db").read_bytes() == before


def test_a_digest_seals_all_that_a_row_says(tmp_path):
    with closing(TrialDatabase(tmp_path / "t.db", CAMPAIGN)) as database:
        database.add(PAIR, 4, RECORD)
    connection = sqlite3.connect(tmp_path / "t.db")
    connection.row_factory = sqlite3.Row
    row = dict(connection.execute("SELECT * FROM trial").fetchone())
    # Computed here by hand: names in order, numbers as JSON writes them.
    digest = row.pop("digest")
    said = ", ".join(f"{json.dumps(name)}: {json.dumps(row[name])}" for name in sorted(row))
    assert digest == hashlib.sha256(f"{{{said}}}".encode()).hexdigest()


@pytest.mark.parametrize(
    ("wrong", "column"),
    [
        ({"next_state": -1}, "next_state"),
        ({"outcome": Outcome.HELD}, "next_state"),
        ({"drift": 0.5}, "drift"),
        ({"speed": float("nan")}, "speed"),
        ({"turn": (3.0, 3.0, 0.0)}, "turn_x"),
        ({"fault": "it gave up"}, "fault"),
        ({"noise": replace(NOISE, mass=0.0)}, "noise"),
    ],
)
def test_what_could_not_be_read_again_is_not_written(tmp_path, wrong, column):
    database = TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    with pytest.raises(ModelError, match=f"could not be written .*column '{column}'"):
        database.add(PAIR, 0, replace(RECORD, **wrong))
    assert database.done() == set()


def test_a_log_in_a_folder_that_cannot_be_written_is_not_passed_over(tmp_path, monkeypatch):
    database = TrialDatabase(tmp_path / "t.db", CAMPAIGN)
    database.add(PAIR, 0, RECORD)  # in the log so far, not in the file
    monkeypatch.setattr("os.access", lambda *_: False)
    assert len(list(TrialDatabase(tmp_path / "t.db").trials())) == 1
