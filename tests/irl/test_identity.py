from pathlib import Path

import pytest

from irl.errors import InputError
from irl.identity import require_same_work

FILE = Path("out/kept.json")


def test_equal_settings_pass_also_as_json_gives_them_back():
    require_same_work(FILE, {"sizes": [7, 25], "seed": 0}, {"seed": 0, "sizes": (7, 25)})


def test_a_refusal_names_the_file_and_all_that_differs_there_and_here():
    with pytest.raises(InputError) as refused:
        require_same_work(FILE, {"a": 1, "b": 2, "c": 3}, {"a": 1, "b": 4, "d": 5})
    assert str(refused.value) == (
        "out/kept.json: kept by other work, differing in b (2 there, 4 here), "
        "c (3 there, nothing here), d (nothing there, 5 here); "
        "run with the former settings, delete it, or name another"
    )
    assert refused.value.place == "out/kept.json"


def test_hashes_are_shown_by_their_beginning_and_the_remedy_is_the_callers():
    with pytest.raises(InputError, match=r'model \("aaaaaaaaaaaa… there, nothing here\); ask$'):
        require_same_work(FILE, {"model": "a" * 64}, {}, remedy="ask")
