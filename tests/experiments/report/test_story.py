"""RESULTS.md's tables are what the kept results say, and what is missing is named."""

import json
from pathlib import Path

import pytest

from experiments.grasping.tables.lesson import MEASURED
from experiments.kit.command import Output
from experiments.report import story
from experiments.report.cells import share
from experiments.report.claims import CLAIMS
from experiments.report.parts import MADE, PARTS, RESULT, Kept, shipped_task

MEASURES = {name: [0.5, 0.75] for name in MEASURED}


def cell(method, chosen, advice):
    return {"method": method, "demonstration_set": chosen, "advice": advice, **MEASURES}


TABLE = {
    "seeds": [0, 1],
    "rows": [
        cell(method, chosen, advice)
        for method in ("fa_mlirl", "thesis")
        for chosen in ("initial", "random", "active")
        for advice in ("none", "action", "state", "both")
    ],
}


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results"
    own = folder / "grasping" / "table"
    own.mkdir(parents=True)
    (own / RESULT).write_text(json.dumps(TABLE))
    made = {"command": "python -m experiments.grasping table --seeds 2", "cores": 2}
    made |= {"processor": "P", "packages": {"torch": "1"}}
    (own / MADE).write_text(json.dumps(made))
    (own / "accuracy.png").write_bytes(b"")
    return folder


def told(tmp_path, results, *options, capsys=None):
    config = story.Config(results=results, file=tmp_path / "R.md", out=tmp_path / "out")
    result = story.main(config, Output(tmp_path / "out", config))
    return result, (tmp_path / "R.md").read_text()


def test_what_is_kept_is_told_and_what_is_missing_is_named(tmp_path, results, capsys):
    result, text = told(tmp_path, results)
    assert result["told"] == ["grasping/table"]
    assert "grasping/questions" in result["missing"]
    assert "missing: grasping/questions" in capsys.readouterr().out
    row = next(line for line in text.splitlines() if line.startswith("| thesis' network | 981"))
    assert "| 8 | 62.5 [50.0, 75.0] |" in row
    assert "`python -m experiments.grasping table --seeds 2`, on 2 cores of P; torch 1" in text
    assert (
        "![Accuracy by demonstration set and advice](results/grasping/table/accuracy.png)" in text
    )
    assert "curves.png" not in text
    head = text.split("## Table 6.3")[0]
    assert head.count("*not measured yet*") == len(CLAIMS) - 3
    assert "`python -m experiments.grasping questions`" in text.split("## Not measured yet")[1]


def test_all_parts_are_named_that_nobody_measured(tmp_path):
    result, text = told(tmp_path, tmp_path / "none")
    assert result == {"told": [], "missing": [part.name for part in PARTS], "in_part": []}
    assert text.count("*not measured yet*") == len(CLAIMS)
    rows = text.split("## Not measured yet")[1].splitlines()
    for part in PARTS:
        assert f"| {part.title} | all | `{part.as_typed}` | {part.minutes} |" in rows


def test_what_was_measured_in_part_or_on_other_task_data_says_so(tmp_path, results, capsys):
    result, text = told(tmp_path, results)
    assert result["in_part"] == ["grasping/table"]
    lesser = "less was measured than this command does"
    assert f"*To be measured again: {lesser}.*" in text
    assert f"| Table 6.3: states, questions and advice | {lesser} |" in text
    assert f"missing: grasping/table, {lesser}" in capsys.readouterr().out
    file = results / "grasping" / "table" / MADE
    whole = "python -m experiments.grasping table"
    made = json.loads(file.read_text()) | {"command": whole, "task": shipped_task()}
    file.write_text(json.dumps(made))
    result, text = told(tmp_path, results)
    assert result["in_part"] == []
    assert "To be measured again" not in text
    file.write_text(json.dumps({**made, "task": "0123456789"}))
    result, text = told(tmp_path, results)
    assert result["in_part"] == ["grasping/table"]
    assert "measured on other task data, 01234567…" in text
    assert text.split("## Table 6.3")[0].count("(on other task data)") == 3


def test_a_result_of_another_form_is_refused_by_name(tmp_path, results, refused):
    file = results / "grasping" / "table" / RESULT
    file.write_text(json.dumps({"rows": [{"method": "thesis"}]}))
    said = refused(story, "--results", results, "--file", tmp_path / "R.md")
    assert str(file) in said
    assert "KeyError('demonstration_set')" in said
    assert "--run --again --parts grasping/table" in said


def test_one_seed_has_no_interval():
    assert share([0.25]) == "25.0 (one seed)"
    assert share([0.25, 0.75]) == "50.0 [25.0, 75.0]"


def test_the_text_around_the_marks_stays(tmp_path, results):
    file = tmp_path / "R.md"
    file.write_text(f"# Mine\n\nbefore\n\n{story.BEGIN}\nold\n{story.END}\n\nafter\n")
    _, text = told(tmp_path, results)
    assert text.startswith("# Mine\n\nbefore\n") and text.endswith(f"{story.END}\n\nafter\n")
    assert "old" not in text
    assert told(tmp_path, results)[1] == text


def test_a_document_without_marks_is_refused(tmp_path, results, refused):
    (tmp_path / "R.md").write_text("# Mine\n")
    said = refused(story, "--results", results, "--file", tmp_path / "R.md")
    assert "has no marks" in said
    assert (tmp_path / "R.md").read_text() == "# Mine\n"


def test_missing_parts_are_made_kept_and_not_made_again(tmp_path, results, monkeypatch, capsys):
    ran, part = [], next(p for p in PARTS if p.name == "grasping/enough")

    class Done:
        returncode = 0

    def run(command, **_):
        out = Path(command[command.index("--out") + 1])
        out.mkdir(parents=True)
        (out / RESULT).write_text(
            '{"lessons": 200, "stopped": 190, "right_share": 0.98765432, "reaches": 7, "unsure": 3,'
            '"contradicted": 30, "contradicted_reaches": 6,'
            '"labels_mean": 22.5, "stopped_labels_mean": 21.5,'
            '"checks": 900, "checks_right": 899, "simple_rules": ['
            '{"rule": "labels agree", "stopped": 200, "wrong": 20, "labels_mean": 10.25,'
            '"success_mdp_mean": 0.9, "accuracy_optimal_all_mean": 0.75},'
            '{"rule": "fixed number", "stopped": 0, "wrong": 0}]}'
        )
        for name, _ in part.pictures:
            (out / name).write_bytes(b"")
        ran.append(command[2:5])
        return Done()

    monkeypatch.setattr(story.subprocess, "run", run)
    whole = {"command": "python -m experiments.grasping table", "packages": {}}
    whole |= {"cores": 2, "processor": "P"}
    (results / "grasping" / "table" / MADE).write_text(json.dumps(whole))
    parts = ("grasping/table", "grasping/enough")
    config = story.Config(
        run=True, parts=parts, results=results, file=tmp_path / "R.md", out=tmp_path / "out"
    )
    for _ in range(2):
        story.main(config, Output(tmp_path / "out", config))
    assert ran == [["experiments.grasping", "enough", "--lessons"]]
    minutes = part.minutes
    assert (
        f"1 parts to make: about {minutes} minutes of processor time, {minutes / 2:g} by the clock"
        in capsys.readouterr().out
    )
    kept = Kept(results / "grasping" / "enough")
    assert kept.result["right_share"] == 0.987654
    assert kept.made["command"] == "python -m experiments.grasping enough --lessons 200"
    assert kept.made["task"] == shipped_task()
    text = (tmp_path / "R.md").read_text()
    assert "ended 190 of 200 lessons" in text
    assert "| all | 200 | 190 | 98.8 % | 7 | 3 | 6 of 30 | 22.5 | 21.5 |" in text
    assert "| labels agree | 200 | 20 | 10.2 | 90.0 | 75.0 |" in text
    assert "| fixed number | 0 | 0 |  |  |  |" in text


def test_what_was_measured_on_other_task_data_is_not_said_to_be_once_it_is_made_anew(
    tmp_path, results
):
    (part,) = (part for part in PARTS if part.name == "grasping/table")
    kept = Kept(results / "grasping" / "table")
    made = results / "grasping" / "table" / MADE
    made.write_text(json.dumps({**json.loads(made.read_text()), "task": "0" * 64}))
    assert "other task data" in kept.lacks(part)
    out = tmp_path / "made"
    out.mkdir()
    (out / RESULT).write_text(json.dumps({**TABLE, "anew": True}))
    for name, _ in part.pictures:
        (out / name).write_bytes(b"")
    kept.keep(part, out)
    assert kept.lacks(part) == ""
    assert kept.result["anew"]


def test_a_claim_about_rows_that_were_not_measured_says_so(tmp_path, results):
    ours = [row for row in TABLE["rows"] if row["method"] == "fa_mlirl"]
    kept = results / "grasping" / "table" / RESULT
    kept.write_text(json.dumps({**TABLE, "rows": ours}))
    _, text = told(tmp_path, results)
    head = text.split("## Table 6.3")[0]
    assert head.count("*not measured yet*") == len(CLAIMS) - 2
    assert "| Our network at 8.11 % of the states | an action as good in 62.5" in head


def test_every_claim_has_a_part():
    assert len(CLAIMS) == 10
    assert {name for _, name, _ in CLAIMS} <= {part.name for part in PARTS}


def test_the_documents_tables_are_those_of_the_kept_results(tmp_path):
    text = (story.ROOT / "RESULTS.md").read_text(encoding="utf-8")
    file = story.ROOT / "RESULTS.md"
    config = story.Config(file=file, out=tmp_path / "out")
    kept = {part.name: Kept(config.results / part.name) for part in PARTS}
    body = "\n".join(story.sections(kept, config)).strip()
    assert text.split(story.BEGIN)[1].split(story.END)[0].strip() == body
