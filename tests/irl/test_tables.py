from types import SimpleNamespace

import numpy as np
import pytest

from irl.demonstrations import SOURCES, Demonstrations
from irl.errors import InputError
from irl.tables import Columns, from_csv, from_frame

ROWS = [(7, 0, 0, 1), (7, 1, 1, 1), (9, 0, 4, 0)]  # trajectory, step, state, action
HEADER = "trajectory,step,state,action"
PLAIN = "\n".join([HEADER, *(",".join(map(str, row)) for row in ROWS)])


def rows_of(shown):
    columns = (shown.trajectory, shown.step, shown.state, shown.action)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def csv(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "d.csv"
    path.write_bytes(text.encode(encoding))
    return path


class Frame:
    """As much of a `pandas.DataFrame` as is read: its columns, and each by its name."""

    def __init__(self, **columns):
        self.columns = list(columns)
        self._columns = columns

    def __getitem__(self, name):
        return self._columns[name]


AS_WRITTEN = {
    "plain": PLAIN,
    "mark": "\ufeff" + PLAIN,
    "Excel": "\ufeff" + PLAIN.replace("\n", "\r\n") + "\r\n,,,\r\n\r\n",
    "Excel elsewhere": "\ufeff" + PLAIN.replace(",", ";").replace("\n", "\r\n") + "\r\n",
    "pandas": "\n".join(f"{'' if k == 0 else k - 1},{x}" for k, x in enumerate(PLAIN.split("\n"))),
    "quoted": PLAIN.replace("0", '"0"').replace("state", '"state"'),
    "floats": PLAIN.replace(",4,0", ",4.0,0.0"),
    "end of run": PLAIN + "\n9,1,3,\n",
    "more": PLAIN.replace("\n", ",0.5\n").replace("action,0.5", "action,reward") + ",x",
}


@pytest.mark.parametrize("kind", AS_WRITTEN)
def test_a_csv_as_programs_write_it(tmp_path, kind):
    assert rows_of(from_csv(csv(tmp_path, AS_WRITTEN[kind]))) == ROWS


def test_our_own_files_are_read_by_both_doors(tmp_path):
    Demonstrations.from_pairs([(0, 1), (1, 1)], source="human").save(tmp_path / "d.csv")
    shown = from_csv(tmp_path / "d.csv", source="human")
    assert rows_of(shown) == rows_of(Demonstrations.load(tmp_path / "d.csv"))
    assert {SOURCES[k] for k in shown.source} == {"human"}


def test_rows_without_numbers_of_runs_and_steps_are_taken_only_when_told(tmp_path):
    path = csv(tmp_path, "state,action\n0,1\n1,1\n")
    with pytest.raises(InputError, match=r"no column 'trajectory'; .*trajectory=None.*; valid: st"):
        from_csv(path)
    with pytest.raises(InputError, match=r"no column 'step'; .*Columns\(step=None\)"):
        from_csv(path, Columns(trajectory=None))
    shown = from_csv(path, Columns(trajectory=None, step=None))
    assert rows_of(shown) == [(0, 0, 0, 1), (0, 1, 1, 1)]


def test_runs_may_have_names_and_rows_be_in_order(tmp_path):
    path = csv(tmp_path, "who,s,a\nben,0,1\nben,1,1\nann,4,0\n")
    columns = Columns("who", None, "s", "a")
    assert rows_of(from_csv(path, columns)) == [(0, 0, 0, 1), (0, 1, 1, 1), (1, 0, 4, 0)]
    again = csv(tmp_path, "who,s,a\nben,0,1\nann,1,1\nben,4,0\n")
    with pytest.raises(InputError, match="line 4, column 'who' takes up a run that had ended"):
        from_csv(again, columns)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        (PLAIN.replace("\n9", "\n\n9"), "line 4 is blank, with more after it"),
        (PLAIN.replace("4,0", "4.5,0"), "line 4, column 'state' must be an integer .* is '4.5'"),
        (PLAIN.replace("4,0", "4,left"), "line 4, column 'action' .* is 'left'"),
        (PLAIN.replace("4,0", ",0"), "line 4, column 'state' .* is empty"),
        (PLAIN.replace("7,0,0,1", "7,0,0,"), "line 2, column 'action' is empty, but its run goes"),
        (PLAIN.replace("4,0", "4,0,1"), "line 4 has 5 columns, the header has 4"),
        (PLAIN.replace("7,1", "7,0"), "trajectory 7 has step 0 more than once"),
        (PLAIN.replace("step", "state"), "no column 'step'"),
        (PLAIN.replace("\n", ",\n").replace("action,", "action,step"), "'step' is there 2 times"),
        (PLAIN.replace("9,", ",", 1), "line 4, column 'trajectory' .* empty"),
        (PLAIN.replace("9,0,4,0", '9,0,4,"0'), "not valid CSV"),
        (PLAIN.replace("4,0", f"{10**18},0"), "line 4, column 'state'"),
    ],
)
def test_what_a_csv_does_not_say_is_refused_with_its_place(tmp_path, text, words):
    with pytest.raises(InputError, match=rf"d\.csv: .*{words}") as refusal:
        from_csv(csv(tmp_path, text))
    assert "\n" not in str(refusal.value)


def test_text_that_is_not_utf8_is_refused(tmp_path):
    with pytest.raises(InputError, match="not UTF-8"):
        from_csv(csv(tmp_path, "\ufeff" + PLAIN, "utf-16-le"))


def frame(**changes):
    columns = dict(zip(HEADER.split(","), np.array(ROWS).T, strict=True)) | changes
    return Frame(**columns)


def test_a_frame_is_known_by_its_columns():
    class NAType:  # as pandas marks what is missing among its own integers
        def __eq__(self, other):
            return self

        def __bool__(self):
            raise TypeError("boolean value of NA is ambiguous")

        __hash__ = None

    assert rows_of(from_frame(frame())) == ROWS
    assert rows_of(from_frame({name: frame()[name] for name in HEADER.split(",")})) == ROWS
    assert rows_of(from_frame(frame(reward=[0.1, 0.2, 0.3]))) == ROWS
    for gap in (np.nan, None, NAType()):
        ended = frame(action=np.array([1, 1, gap], dtype=object))
        assert rows_of(from_frame(ended)) == ROWS[:2]
    assert rows_of(from_frame(frame(action=np.array([1.0, 1.0, np.nan])))) == ROWS[:2]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"state": [0, 1, 0.5]}, "frame: row 2, column 'state' must be an integer .* is 0.5"),
        ({"state": [0, 1, -1]}, "row 2, column 'state' .* is -1"),
        ({"state": [True, False, True]}, "row 0, column 'state' .* is True"),
        ({"state": [0, 1]}, "columns of one length wanted"),
        ({"state": np.zeros((3, 2))}, "row 0, column 'state'"),
        ({"action": [1, np.inf, 0]}, "row 1, column 'action' .* is inf"),
    ],
)
def test_a_frame_with_another_kind_of_column_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        from_frame(frame(**changes))


def test_what_has_no_columns_is_no_frame():
    with pytest.raises(InputError, match="SimpleNamespace has no columns"):
        from_frame(SimpleNamespace())


def test_pandas_own_frames_and_files(tmp_path):
    pandas = pytest.importorskip("pandas")
    made = pandas.DataFrame(ROWS, columns=HEADER.split(","), index=[5, 5, 5])
    assert rows_of(from_frame(made)) == ROWS
    made.to_csv(tmp_path / "d.csv")
    assert rows_of(from_csv(tmp_path / "d.csv")) == ROWS
    gap = pandas.concat([made, pandas.DataFrame([(9, 1, 3, None)], columns=HEADER.split(","))])
    assert rows_of(from_frame(gap)) == rows_of(from_frame(gap.convert_dtypes())) == ROWS
    gap.to_csv(tmp_path / "d.csv", encoding="utf-8-sig")
    assert rows_of(from_csv(tmp_path / "d.csv")) == ROWS
