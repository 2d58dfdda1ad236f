"""The command: scripts, the terminal, replay in another process, files that are none."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.kit.command import execute
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.story import Config, main, open_lesson
from experiments.teach.worlds import robot_world
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import Answered, Round
from irl.lesson_replay import config_of
from irl.lesson_taught import Taught

GRID = ["--grid", "5"]


def run(*arguments: str) -> dict:
    execute(Config, main, [*GRID, *arguments])
    out = Path(arguments[arguments.index("--out") + 1])
    return json.loads((out / "result.json").read_text())


def script(path: Path, *lines: dict) -> str:
    path.write_text("\n".join(json.dumps(line) for line in lines) + "\n")
    return str(path)


def test_an_oracle_teaches_until_it_is_enough_and_another_process_learns_the_same(tmp_path):
    told = run("--oracle", "60", "--out", str(tmp_path / "a"))
    assert told["enough"] and not told["enough_stands_in"] and told["success_mdp"] == 1.0
    lesson = tmp_path / "a" / "lesson.db"
    command = [sys.executable, "-m", "experiments.teach", *GRID, "--terminal"]
    command += ["--replay", str(lesson), "--out", str(tmp_path / "b")]
    environment = os.environ | {"PYTHONHASHSEED": "7", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    again = json.loads((tmp_path / "b" / "result.json").read_text())
    assert again["policy_hash"] == told["policy_hash"] and told["policy_hash"] in done.stdout
    assert again["answers"] == told["answers"] and again["enough"]
    assert again["report"] == told["report"] and len(told["report"]["at_odds"]) == told["answers"]
    for name in ("demonstrations.csv", "advice.json", "policy.safetensors"):
        assert (tmp_path / "a" / name).is_file()


def test_a_script_says_everything_a_teacher_may_say(tmp_path):
    lines = [
        {"do": "run", "state": 11},
        {"action": 0, "seconds": 3, "previews": 1, "state": 11, "outcome": 12},
        {"action": "done"},
        {"do": "round"},
        {"action": "proposed"},
        {"do": "undo"},
        {"do": "skip"},
        {"do": "another"},
        {"do": "advise", "cluster": "left ∩ above", "preferred": [0], "avoided": [2]},
        {"do": "cluster", "cluster": "right ∩ below"},
        {"do": "correct", "state": 22, "action": 3},
        {"do": "run", "state": 0},
        {"do": "act"},
        {"do": "quit"},
        {"action": "proposed"},
    ]
    path = script(tmp_path / "s.jsonl", *lines)
    told = run("--script", path, "--learner", "planning", "--out", str(tmp_path / "o"))
    assert told["answers"] == 3 and told["policy_hash"] and told["enough_stands_in"]
    with Lesson(tmp_path / "o" / "lesson.db") as lesson:
        answers = [event for event in lesson.events if isinstance(event, Answered)]
    assert (answers[0].state, answers[0].seconds, answers[0].previews) == (11, 3.0, 1)


def test_a_script_gives_the_same_lesson_every_time(tmp_path):
    path = script(tmp_path / "s.jsonl", {"action": "done"}, {"action": "proposed"})
    results = [run("--script", path, "--synchronous", "--initial", "2", "--learner", "fa_mlirl",
                   "--out", str(tmp_path / name)) for name in "ab"]  # fmt: skip
    assert results[0]["policy_hash"] == results[1]["policy_hash"]
    assert results[0]["rounds"] == 3
    other = run("--script", path, "--initial", "2", "--seed", "1", "--out", str(tmp_path / "c"))
    assert other["policy_hash"] != results[0]["policy_hash"]


def test_a_lesson_goes_on_with_the_same_command(tmp_path):
    out = str(tmp_path / "o")
    first = run("--oracle", "4", "--out", out)
    second = run("--oracle", "4", "--out", out)
    assert (first["answers"], second["answers"]) == (4, 8)
    with Lesson(tmp_path / "o" / "lesson.db") as lesson:
        fresh = [event for event in lesson.events if isinstance(event, Round) and event.fresh]
    assert len(fresh) == 2


def refused(capsys, *arguments: str) -> str:
    with pytest.raises(SystemExit) as stop:
        execute(Config, main, [*GRID, *arguments])
    assert stop.value.code == 2
    told = capsys.readouterr().err
    assert told.startswith("error: ") and told.count("\n") == 1
    return told


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("{", "line 2: not JSON"),
        ("3", "an object wanted"),
        ('{"do": "dance"}', "'do' is 'dance'"),
        ('{"do": "edit", "answer": 3}', "field 'action' is missing"),
        ('{"action": 3, "more": 1}', "unknown field 'more'"),
        ('{"action": 1.5}', "field 'action' is 1.5"),
        ('{"action": 3, "action": 2}', "occurs twice"),
        ('{"action": 99}', "action 99 is not feasible"),
        ('{"action": 0, "state": 24}', "state 24"),
        ('{"do": "advise", "cluster": "no"}', "unknown name 'no'"),
        ('{"do": "exclude", "answer": 2, "pairs": [[1]]}', "field 'pairs'"),
        ('{"do": "act"}', "nothing that the learner would do"),
        ('{"action": "proposed"}', "nothing is proposed"),
        ('{"action": 0, "outcome": 999}', "no state 999"),
        ('{"do": "run", "state": 999}', "no state 999"),
        ('{"do": "correct", "state": 999, "action": 1}', "no state 999"),
        ('{"do": "edit", "answer": 99, "action": 1}', "no answer 99"),
    ],
)
def test_a_wrong_line_of_a_script_is_named_and_what_came_before_is_kept(
    tmp_path, capsys, line, told
):
    path = tmp_path / "s.jsonl"
    path.write_text('{"do": "run", "state": 11}\n' + line + "\n")
    said = refused(capsys, "--script", str(path), "--out", str(tmp_path / "o"))
    assert told in said and "s.jsonl: line 2" in said
    with Lesson(tmp_path / "o" / "lesson.db") as lesson:
        assert lesson.events[-1].state == 11


def test_what_is_no_lesson_or_anothers_is_refused_and_left_as_it_is(tmp_path, capsys):
    mine = tmp_path / "mine.db"
    mine.write_bytes(b"my notes")
    out = str(tmp_path / "o")
    for option in ("--lesson", "--replay"):
        assert "mine.db" in refused(capsys, option, str(mine), "--oracle", "1", "--out", out)
    assert mine.read_bytes() == b"my notes"
    run("--oracle", "2", "--out", out)
    lesson = str(tmp_path / "o" / "lesson.db")
    elsewhere = str(tmp_path / "p")
    assert "seed" in refused(
        capsys, "--lesson", lesson, "--seed", "1", "--oracle", "1", "--out", elsewhere
    )
    assert "method" in refused(
        capsys, "--lesson", lesson, "--learner", "planning", "--oracle", "1", "--out", elsewhere
    )
    with pytest.raises(SystemExit):
        execute(Config, main, ["--grid", "7", "--replay", lesson, "--out", elsewhere])
    assert "about the task" in capsys.readouterr().err
    none = script(tmp_path / "none.jsonl", {"do": "quit"})
    run("--script", none, "--out", str(tmp_path / "q"))
    empty = str(tmp_path / "q" / "lesson.db")
    assert "no round was finished" in refused(capsys, "--replay", empty, "--out", elsewhere)


def test_files_and_another_teachers_lesson_come_in_and_contradictions_are_told(tmp_path, capsys):
    wrong = [{"do": "run", "state": 11}, {"action": 2}, {"action": "done"},
             {"do": "advise", "cluster": "left", "avoided": [0]}]  # fmt: skip
    right = [{"do": "run", "state": 11}, {"action": 0}, {"action": "done"},
             {"do": "advise", "cluster": "left", "preferred": [0]}]  # fmt: skip
    one, two = (str(tmp_path / name) for name in "ab")
    run("--script", script(tmp_path / "w.jsonl", *wrong), "--learner", "planning", "--out", one)
    told = run("--script", script(tmp_path / "r.jsonl", *right), "--learner", "planning",
               "--merge", f"{one}/lesson.db", "--demonstrations", f"{one}/demonstrations.csv",
               "--advice", f"{one}/advice.json", "--out", two)  # fmt: skip
    said = capsys.readouterr().out
    assert "contradictions with" in said
    assert {c["kind"] for c in told["conflicts"]} <= {"answer", "advice", "advice against answer"}
    third = str(tmp_path / "c")
    again = run("--script", script(tmp_path / "n.jsonl", {"do": "round"}), "--learner", "planning",
                "--demonstrations", f"{two}/demonstrations.csv", "--out", third)  # fmt: skip
    assert again["answers"] == 0 and again["policy_hash"]


def test_the_terminal_asks_in_words_and_understands_words(tmp_path, capsys, monkeypatch):
    typed = "w|a|clusters|nonsense||a99|right|d|u|d|1|n|s|avoid left: x|avoid left: 2|?|q"
    lines = iter(typed.split("|"))
    monkeypatch.setattr("builtins.input", lambda prompt: next(lines))
    path = tmp_path / "o"
    told = run("--terminal", "--learner", "planning", "--out", str(path))
    said = capsys.readouterr().out
    assert "grid of 5 × 5 cells; planning learns" in said
    assert "column" in said and "row" in said and "Enter" in said
    assert "the cells left of the middle" in said and "taken back" in said
    assert "done: nothing to do here" in said
    assert told["answers"] >= 2
    assert "numbers of actions wanted" in said and "in 10 states" in said


def test_what_was_said_in_the_terminal_is_listed_changed_and_taken_back(
    tmp_path, capsys, monkeypatch
):
    typed = ['{"do": "run", "state": 11}', "up", "prefer left: 1 3", "avoid left: 3 2", "said",
             "edit {answer}: right", "edit 999: up", "edit {answer}: nonsense", "s", "undo 999",
             '{"do": "edit"', "q"]  # fmt: skip
    path = tmp_path / "o" / "lesson.db"

    def type_in(prompt):
        line = typed.pop(0)
        with Lesson(path, writable=False) as lesson:
            numbers = [k for k, e in enumerate(lesson.events, 1) if isinstance(e, Answered)]
        return line.replace("{answer}", str(numbers[-1])) if "{answer}" in line else line

    monkeypatch.setattr("builtins.input", type_in)
    run("--terminal", "--learner", "planning", "--out", str(tmp_path / "o"))
    with Lesson(path, writable=False) as lesson:
        taught = Taught.of(lesson.events)
        ((number, answer),) = taught.answers.items()
        assert (answer.state, answer.action) == (11, 0)
        assert [(p.preferred, p.avoided) for p in taught.advised] == [([1], [2, 3])]
    said = capsys.readouterr().out
    assert f"{number}     up · column 2, row 3" in said
    assert "prefer up; avoid left, down · the cells left of the middle" in said
    assert "no answer 999 holds" in said and "0 actions have these words" in said
    assert "nothing said under 999" in said and "not JSON" in said


def test_rules_label_what_follows_where_they_are_asked_for_and_the_learner_uses_them(tmp_path):
    world = robot_world(SHIPPED_TASK)
    names = tuple(n for n in world.subject.generalisation.rule_names if "drop" not in n)
    for k, (config, rules) in enumerate(
        [
            (Config(learner="fa_mlirl", generalise=True), names),
            (Config(learner="fa_mlirl"), ()),
            (Config(), ()),
        ]
    ):
        with open_lesson(world, config, tmp_path / f"{k}.db") as lesson:
            assert config_of(lesson, world.subject).rules == rules and names
    for learner in ("goal_posterior", "planning"):
        with pytest.raises(InputError, match="fa_mlirl"):
            open_lesson(world, Config(learner=learner, generalise=True), tmp_path / "none.db")
    assert not (tmp_path / "none.db").exists()
