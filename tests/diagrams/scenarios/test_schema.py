"""Scenarios' files: all that are shipped, and what is wrong with others."""

import pytest
from pydrake.common.schema import Uniform

from diagrams.scenarios import draw, load_scenario, shipped_scenarios
from diagrams.scenarios.schema import parse_scenario
from models.errors import ModelError

NAMES = (
    *("push", "yank", "slip", "friction_low", "friction_high", "light", "heavy", "noise"),
    *("delay", "weak_joint", "posture", "base", "distractor"),
)


def test_thirteen_scenarios_are_shipped():
    assert shipped_scenarios() == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_tells_what_it_is_and_is_read_again_as_it_was_saved(name):
    scenario = load_scenario(name)
    assert scenario.description.endswith(".")
    again = parse_scenario(scenario.text(), "again")
    assert again.text() == scenario.text()
    for key in ((0, 0, 0), (7, 3, 1)):
        mine, other = draw(scenario, key), draw(again, key)
        assert repr(mine.leads) == repr(other.leads)
        assert (mine.friction, mine.mass) == (other.friction, other.mass)


def test_sizes_are_those_that_were_asked_for():
    push = load_scenario("push").push
    assert isinstance(push.distance, Uniform)
    assert (push.distance.min, push.distance.max) == (0.02, 0.05)
    assert load_scenario("friction_low").friction == 0.3
    assert load_scenario("heavy").mass == 0.5
    weak = load_scenario("weak_joint").weak_joint
    assert (weak.joint, weak.share) == (4, 0.6)


def test_a_file_of_ones_own_combines_what_it_likes(tmp_path):
    file = tmp_path / "both.yaml"
    file.write_text("mass: 0.2\npush: { distance: 0.03, turn: 10 }\n")
    scenario = load_scenario(str(file))
    assert (scenario.mass, scenario.push.distance, scenario.slip) == (0.2, 0.03, None)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("push: { distanc: 0.1 }", "distanc"),
        ("friction: rough", "rough"),
        ("mas: 3", "mas"),
        ("friction: 7", "field 'friction' is 7; valid: 0.01 to 2"),
        ("push: { distance: !Uniform { min: 0.05, max: 0.02 } }", "field 'push.distance'"),
        ("weak_joint: { joint: 8, share: 0.5 }", "field 'weak_joint.joint' is 8; valid: 1 to 7"),
        ("noise: { position: .nan }", "field 'noise.position'"),
        ("push: [", "flow"),
        ("friction: !Gauss { mean: 1 }", "Gauss"),
        ("", "file.yaml"),
    ],
)
def test_what_is_wrong_is_told_in_one_line_by_file_and_field(text, told):
    with pytest.raises(ModelError) as refused:
        parse_scenario(text, "file.yaml")
    message = str(refused.value)
    assert message.startswith("file.yaml: ") and told in message and "\n" not in message


def test_a_name_that_nobody_ships_is_refused_with_those_that_are():
    with pytest.raises(ModelError, match=r"earthquake: valid: base, delay, .*, or a file"):
        load_scenario("earthquake")
