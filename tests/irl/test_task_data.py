import json
import shutil
from dataclasses import fields, replace

import numpy as np
import pytest

from irl.errors import InputError
from irl.files import sha256
from irl.formats import read_json
from irl.npz import read_npz, write_npz
from irl.task_data import FILES, TaskData, load_task, save_task


@pytest.fixture
def folder(small_task, tmp_path):
    save_task(small_task, tmp_path / "task")
    return tmp_path / "task"


def refusal(folder) -> str:
    """What ``load_task`` says, checked to be one line."""
    with pytest.raises(InputError) as caught:
        load_task(folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def edit_head(folder, **changes):
    """Change fields of task.json; ``None`` removes one."""
    head = json.loads((folder / "task.json").read_text()) | changes
    head = {name: value for name, value in head.items() if value is not None}
    (folder / "task.json").write_text(json.dumps(head))


def rewrite(folder, file, change):
    """Change a file and record its new hash, so that only the content is wrong."""
    path = folder / file
    if file.endswith(".npz"):
        arrays = read_npz(path)
        change(arrays)
        write_npz(path, arrays)
    elif file.endswith(".json"):
        value = read_json(path)
        change(value)
        path.write_text(json.dumps(value))
    else:
        path.write_text(change(path.read_text()))
    edit_head(
        folder, files=json.loads((folder / "task.json").read_text())["files"] | {file: sha256(path)}
    )


def assert_same(a: TaskData, b: TaskData):
    assert (a.name, a.states, a.actions, a.gamma) == (b.name, b.states, b.actions, b.gamma)
    assert (a.fixed_vr, a.provenance) == (b.fixed_vr, b.provenance)
    assert a.generalisation.rule_names == b.generalisation.rule_names
    for name in ("features", "clusters"):
        assert getattr(a, name).keys() == getattr(b, name).keys()
        for key, array in getattr(b, name).items():
            np.testing.assert_array_equal(getattr(a, name)[key], array, strict=True)
    for name in ("goal_states", "start_states", "preferred", "avoided"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), strict=True)
    for name in ("transitions", "generalisation", "demonstrations"):
        one, other = getattr(a, name), getattr(b, name)
        for column in fields(one):
            if column.name != "rule_names":
                np.testing.assert_array_equal(
                    getattr(one, column.name), getattr(other, column.name), strict=True
                )


def test_round_trip_is_exact(small_task, folder):
    task = load_task(folder)
    assert_same(task, small_task)
    assert task.task_hash == sha256(folder / "task.json")
    assert (task.n_states, task.n_actions, task.model.n_pairs) == (4, 2, 6)
    assert small_task.task_hash == ""


def test_equal_tasks_give_equal_bytes(small_task, folder, tmp_path):
    other = tmp_path / "other"
    task_hash = save_task(load_task(folder), other)
    assert task_hash == load_task(folder).task_hash
    for file in ("task.json", *FILES):
        assert (folder / file).read_bytes() == (other / file).read_bytes(), file


def test_every_change_changes_the_hash(small_task, folder, tmp_path):
    first = load_task(folder).task_hash
    states = [row | {"note": "x"} for row in small_task.states]
    assert save_task(replace(small_task, states=states), tmp_path / "b") != first
    assert save_task(replace(small_task, gamma=0.8), tmp_path / "c") != first


def test_saving_replaces_an_older_task_and_leaves_nothing_else(small_task, folder):
    save_task(replace(small_task, name="newer"), folder)
    assert load_task(folder).name == "newer"
    assert [path.name for path in folder.parent.iterdir()] == ["task"]
    assert {path.name for path in folder.iterdir()} == {"task.json", *FILES}


@pytest.mark.parametrize("present", [["notes.txt"], ["actions.csv"], ["task.json", "notes.txt"]])
def test_a_folder_with_anything_else_is_not_overwritten(small_task, tmp_path, present):
    mine = tmp_path / "mine"
    mine.mkdir()
    for name in present:
        (mine / name).write_text("precious")
    with pytest.raises(InputError, match="not overwritten"):
        save_task(small_task, mine)
    assert sorted(path.name for path in mine.iterdir()) == sorted(present)
    with pytest.raises(InputError, match="not overwritten"):
        save_task(small_task, mine / present[0])


def test_an_empty_folder_may_be_filled(small_task, tmp_path):
    (tmp_path / "new").mkdir()
    save_task(small_task, tmp_path / "new")
    save_task(small_task, tmp_path / "deep" / "er")
    assert load_task(tmp_path / "deep" / "er").name == "chain"


def test_a_failed_save_leaves_the_older_task(small_task, folder):
    unwritable = replace(small_task, provenance={"what": object()})
    with pytest.raises(TypeError):
        save_task(unwritable, folder)
    assert load_task(folder).name == "chain"
    assert [path.name for path in folder.parent.iterdir()] == ["task"]


def test_names_are_looked_up_with_the_valid_ones_listed(small_task):
    assert small_task.feature("thesis").shape == (4, 2)
    assert small_task.cluster("low").tolist() == [0, 1]
    with pytest.raises(InputError, match=r"features\.npz: no field 'x'; valid: thesis, rotation"):
        small_task.feature("x")
    with pytest.raises(InputError, match=r"clusters\.json: no field 'x'; valid: low, all"):
        small_task.cluster("x")


def test_a_missing_folder_is_named(tmp_path):
    assert "no such task data directory" in refusal(tmp_path / "none")


@pytest.mark.parametrize("file", ["task.json", *FILES])
def test_a_missing_file_is_named(folder, file):
    (folder / file).unlink()
    message = refusal(folder)
    assert str(folder / file) in message
    assert "no such file" in message


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("damage", ["truncate", "flip"])
def test_a_damaged_file_is_named_before_it_is_parsed(folder, file, damage):
    content = bytearray((folder / file).read_bytes())
    if damage == "truncate":
        content = content[:-1]
    else:
        content[len(content) // 2] ^= 1
    (folder / file).write_bytes(content)
    message = refusal(folder)
    assert str(folder / file) in message
    assert "SHA-256" in message


@pytest.mark.parametrize("kept", [0, 10, 200])
def test_a_truncated_task_json_is_refused(folder, kept):
    (folder / "task.json").write_bytes((folder / "task.json").read_bytes()[:kept])
    assert "task.json: not valid JSON" in refusal(folder)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"schema_version": 2}, "'schema_version' is 2; supported: 1"),
        ({"schema_version": "1"}, "'schema_version' is '1'; supported: 1"),
        ({"schema_version": True}, "'schema_version' is True; supported: 1"),
        ({"schema_version": None}, "'schema_version' is None; supported: 1"),
        ({"name": None}, "field 'name' is missing"),
        ({"name": 3}, "field 'name' must be a string"),
        ({"n_states": "4"}, "field 'n_states' must be an integer"),
        ({"n_states": 5}, "states.csv: 4 rows, but task.json counts 5"),
        ({"n_actions": 3}, "actions.csv: 2 rows, but task.json counts 3"),
        ({"gamma": 1.0}, "task.json: field 'gamma' must lie in [0, 1)"),
        ({"gamma": "0.9"}, "field 'gamma' must be a number"),
        ({"gamma": True}, "field 'gamma' must be a number"),
        ({"goal_states": [4]}, "field 'goal_states' must lie in 0…3, holds 4"),
        ({"goal_states": []}, "field 'goal_states' must not be empty"),
        ({"goal_states": [1.5]}, "field 'goal_states' must be a list of integers"),
        ({"start_states": [0, 0]}, "field 'start_states' names a state twice"),
        ({"start_states": [10**30]}, "field 'start_states' holds an integer out of range"),
        ({"start_states": "all"}, "field 'start_states' must be a list"),
        ({"fixed_vr": {"9": -1}}, "field 'fixed_vr' must give finite values to states 0…3"),
        ({"fixed_vr": {"x": -1}}, "field 'fixed_vr' must give numbers to state indices"),
        ({"fixed_vr": {"1": "-1"}}, "field 'fixed_vr' must give numbers"),
        ({"generalisation_rules": ["onwards"]}, "'generalisation_rules', names 1 rules"),
        ({"generalisation_rules": [1, 2]}, "'generalisation_rules' must be a list of names"),
        ({"files": {}}, "field 'files' 'states.csv' is missing"),
        ({"colour": 1}, "field 'colour' is unknown; valid: schema_version, name"),
    ],
)
def test_a_bad_field_of_task_json_is_named(folder, changes, words):
    edit_head(folder, **changes)
    message = refusal(folder)
    assert words in message
    assert str(folder) in message


def test_an_unknown_recorded_file_is_named(folder):
    files = json.loads((folder / "task.json").read_text())["files"]
    edit_head(folder, files=files | {"extra.npz": "00"})
    assert "field 'files' 'extra.npz' is unknown" in refusal(folder)


def test_task_json_must_be_an_object(folder):
    (folder / "task.json").write_text("[]")
    assert "task.json: must hold a JSON object" in refusal(folder)


def put(name, value):
    return lambda content: content.__setitem__(name, value)


def put_at(name, index, value):
    return lambda content: content[name].__setitem__(index, value)


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("features.npz", put_at("thesis", (1, 1), np.nan), "'thesis' must be finite"),
        ("features.npz", put("thesis", np.zeros((3, 2))), "'thesis' must be float32 or float64 [4"),
        ("features.npz", put("thesis", np.zeros(4)), "'thesis' must be float32 or float64 [4, d]"),
        ("features.npz", put("thesis", np.zeros((4, 2), int)), "is int64 [4, 2]"),
        ("transitions.npz", put_at("probability", 0, np.nan), "'probability' must be finite"),
        ("transitions.npz", put_at("probability", 1, 0.8), "'probability' must sum to 1"),
        ("transitions.npz", put_at("state", 0, 4), "'state' must lie in 0…3"),
        ("transitions.npz", put_at("next_state", 0, -1), "'next_state' must lie in 0…3"),
        ("transitions.npz", put_at("action", 0, 2), "'action' must lie in 0…1"),
        ("transitions.npz", put_at("evidence", 0, 3), "'evidence' holds 3; valid: 0 measured"),
        ("transitions.npz", put_at("count", 0, -1), "'count' must be at least 0"),
        ("transitions.npz", put("count", np.zeros(7, int)), "must be int64 [8], is int64 [7]"),
        ("transitions.npz", put("state", np.zeros(8)), "'state' must be int32 [8], is float64 [8]"),
        ("transitions.npz", put("state", np.zeros((8, 1), np.int32)), "'state' must be int32 [8]"),
        ("transitions.npz", put("weight", np.zeros(8)), "'weight' is unknown; valid: state"),
        ("transitions.npz", lambda a: a.pop("count"), "field 'count' is missing"),
        ("generalisation.npz", put_at("state", 0, 4), "'state' must lie in 0…3, holds 4"),
        ("generalisation.npz", put_at("action", 0, 2), "'action' must lie in 0…1, holds 2"),
        ("generalisation.npz", put_at("state", 2, 3), "row 2, not feasible in state 3"),
        ("generalisation.npz", put_at("rule", 3, 2), "'rule' holds 2"),
        ("generalisation.npz", put_at("rule", 0, 1), "'rule' differs within a group"),
        ("generalisation.npz", lambda a: a.pop("group"), "field 'group' is missing"),
        ("clusters.json", put("low", [0, 4]), "field 'low' must lie in 0…3, holds 4"),
        ("clusters.json", put("low", []), "field 'low' must not be empty"),
        ("clusters.json", put("low", [0, "1"]), "field 'low' must be a list of integers"),
        ("clusters.json", put("low", [True]), "field 'low' must be a list of integers"),
        ("state_preferences.json", put("liked", []), "'liked' is unknown; valid: pref"),
        ("state_preferences.json", lambda v: v.pop("avoided"), "field 'avoided' is missing"),
        ("state_preferences.json", put("preferred", [-1]), "'preferred' must lie in 0…3"),
        ("states.csv", lambda text: text.replace("index", "state"), "first column must be 'index'"),
        ("states.csv", lambda text: text.replace("\n2,", "\n7,"), "'index' must be 2, is '7'"),
        ("states.csv", lambda text: text[: text.rindex("3,")], "3 rows, but task.json counts 4"),
        ("actions.csv", lambda text: text + "2,up,x\n", "row 2 has 3 columns"),
        ("demonstrations.csv", lambda text: text + "0,9,3,0,human\n", "not feasible in state 3"),
        ("demonstrations.csv", lambda text: text + "0,9,0,0,dog\n", "'source' is 'dog'; valid"),
        ("demonstrations.csv", lambda text: text + "0,9,8,0,human\n", "'state' is 8, must lie in"),
    ],
)  # fmt: skip
def test_bad_content_is_named_when_hashes_match(folder, file, change, words):
    rewrite(folder, file, change)
    message = refusal(folder)
    assert words in message
    # The task counts its rules in task.json; all else is said of the file itself.
    assert str(folder / file) in message


def test_pickles_are_refused_when_hashes_match(folder):
    np.savez(folder / "features.npz", thesis=np.array([{}], dtype=object))
    files = json.loads((folder / "task.json").read_text())["files"]
    edit_head(folder, files=files | {"features.npz": sha256(folder / "features.npz")})
    assert "features.npz: field 'thesis': cannot be read" in refusal(folder)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"goal_states": [3]}, "'goal_states' must be int64"),
        ({"states": []}, "states.csv: at least one row"),
        ({"states": [{"index": "0"}] * 4}, "'index' left out"),
        ({"actions": [{"a": "x"}, {"b": "x"}]}, "actions.csv: row 1 must have the columns"),
        ({"features": {"thesis": [[0.0]] * 4}}, "'thesis' must be float32 or float64"),
    ],
)
def test_a_task_cannot_be_made_wrong(small_task, changes, words):
    with pytest.raises(InputError, match=words):
        replace(small_task, **changes)


def test_an_unrelated_folder_is_refused(tmp_path):
    shutil.copy(__file__, tmp_path / "file.py")
    assert "task.json: no such file" in refusal(tmp_path)
