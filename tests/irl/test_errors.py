import copy

import pytest

from irl.errors import InputError


def test_the_message_is_one_line_of_place_reason_and_valid_choices():
    error = InputError("no such name 'x'", place="task.json: field 'a'", valid=("b", 3))
    assert str(error) == "task.json: field 'a': no such name 'x'; valid: b, 3"
    assert (error.place, error.reason, error.valid) == (
        "task.json: field 'a'",
        "no such name 'x'",
        ("b", "3"),
    )


def test_a_reason_alone_is_the_message():
    assert str(InputError("n must be above 0, is -1")) == "n must be above 0, is -1"


def test_the_same_mistake_elsewhere_keeps_reason_and_choices():
    elsewhere = InputError("no", place="transitions", valid=("yes",)).at("transitions.npz")
    assert str(elsewhere) == "transitions.npz: no; valid: yes"


def test_fields_survive_the_way_from_another_process():
    # Copies are made as what crosses between processes is: from the arguments and the fields.
    error = copy.copy(InputError("no", place="here", valid=("yes",)))
    assert (str(error), error.place, error.valid) == ("here: no; valid: yes", "here", ("yes",))


def test_it_is_a_value_error():
    with pytest.raises(ValueError, match="no"):
        raise InputError("no")
