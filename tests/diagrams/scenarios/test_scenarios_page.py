"""The page about scenarios: what it lists, and its examples."""

import re
from pathlib import Path

import diagrams
from diagrams.scenarios import shipped_scenarios
from diagrams.scenarios.schema import parse_scenario

PAGE = (Path(diagrams.__file__).parent / "scenarios.md").read_text(encoding="utf-8")


def example(language):
    (text,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return text


def test_the_table_names_every_scenario_that_is_shipped():
    rows = [row.split("|")[1] for row in PAGE.splitlines() if row.startswith("| `")]
    assert sorted(name for row in rows for name in re.findall(r"`(\w+)`", row)) == (
        shipped_scenarios()
    )


def test_the_examples_run(capsys):
    assert parse_scenario(example("yaml"), "page").push.distance == 0.03
    exec(compile(example("python"), "scenarios.md", "exec"), {})
    assert capsys.readouterr().out.strip() == "0.3"
