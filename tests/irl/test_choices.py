from dataclasses import dataclass
from typing import Annotated, Literal

import pytest

from irl.choices import Limits, Members, Settings, check_choice, check_range
from irl.errors import InputError, first_line


def test_an_unknown_name_is_answered_with_the_names_there_are():
    check_choice("avoid", "mask", {"mask": 1, "thesis": 2})
    with pytest.raises(InputError, match="avoid: unknown name 'veil'; valid: mask, thesis") as seen:
        check_choice("avoid", "veil", {"mask": 1, "thesis": 2})
    assert (seen.value.place, seen.value.valid) == ("avoid", ("mask", "thesis"))


@pytest.mark.parametrize(
    ("value", "limits", "words"),
    [
        (-1, {"low": 0}, "must be ≥ 0, is -1"),
        (0, {"low": 0, "open_low": True}, "must be > 0, is 0"),
        (1.5, {"low": 0, "high": 1}, "must be ≥ 0 and ≤ 1, is 1.5"),
        (1, {"low": 0, "high": 1, "open_high": True}, "must be ≥ 0 and < 1, is 1"),
        (float("nan"), {"low": 0}, "is nan"),
    ],
)
def test_a_number_outside_its_range_is_refused(value, limits, words):
    with pytest.raises(InputError, match=f"^gamma: .*{words}") as seen:
        check_range("gamma", value, **limits)
    assert seen.value.place == "gamma"


def test_ends_belong_to_a_range_unless_they_are_open():
    check_range("gamma", 0, 0, 1)
    check_range("gamma", 1, 0, 1)
    check_range("gamma", 0.999, 0, 1, open_high=True)


def test_of_a_foreign_error_one_line_is_shown():
    assert first_line(ValueError("bad\nworse")) == "bad"
    assert first_line(EOFError()) == "EOFError"


@dataclass(frozen=True)
class Base(Settings):
    rate: Annotated[float, Limits(0, 1, open_high=True)] = 0.5
    name: str = "any"


@dataclass(frozen=True)
class Further(Base):
    rate: Annotated[float, Limits(0)] = 0.2
    count: Annotated[int, Limits(1)] = 3


def test_settings_hold_every_field_to_its_limits():
    assert Base(rate=0.0).rate == 0
    with pytest.raises(InputError, match="rate: must be ≥ 0 and < 1, is 1"):
        Base(rate=1)
    with pytest.raises(InputError, match="count: must be ≥ 1, is 0"):
        Further(count=0)


@dataclass(frozen=True)
class Switched(Settings):
    on: bool = False


@pytest.mark.parametrize("value", [-1, 1, "no", None])
def test_a_switch_is_on_or_off(value):
    assert Switched(on=True).on
    with pytest.raises(InputError, match=r"^on: must be true or false, is"):
        Switched(on=value)


def test_a_field_told_anew_has_its_new_limits():
    assert Further(rate=7.0).rate == 7
    with pytest.raises(InputError, match="rate"):
        Further(rate=-7.0)


@dataclass(frozen=True)
class Lists(Settings):
    seeds: Annotated[tuple[int, ...], Limits(0, some=True)] = (0, 1)
    names: Annotated[tuple[str, ...], Members(("a", "b"))] = ("a",)
    widths: Annotated[tuple[int, ...], Limits(1)] = (32, 32)  # may be alike


@pytest.mark.parametrize(
    ("field", "values", "words"),
    [
        ("seeds", (3, 1, 3), "3 is given twice"),
        ("names", ("b", "b"), "b is given twice"),
        ("seeds", (), "at least one value is needed"),
        ("seeds", 5, "several values wanted, is 5"),
        ("names", "a", "several values wanted, is 'a'"),
    ],
)
def test_what_is_to_be_compared_is_there_and_each_once(field, values, words):
    with pytest.raises(InputError, match=f"^{field}: {words}$"):
        Lists(**{field: values})


@dataclass(frozen=True)
class OrAll(Settings):
    count: Annotated[int | Literal["all"], Limits(1)] = 3


def test_a_name_may_stand_in_place_of_a_number():
    assert OrAll("all").count == "all"
    with pytest.raises(InputError, match="count: must be ≥ 1, is 0"):
        OrAll(0)
    with pytest.raises(InputError, match="count: a whole number wanted, is 'most'"):
        OrAll("most")
