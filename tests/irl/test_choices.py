import pytest

from irl.choices import check_choice, check_range
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
