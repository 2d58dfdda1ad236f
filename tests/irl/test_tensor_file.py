import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of

from irl.errors import InputError
from irl.tensor_file import from_bytes, to_bytes

DTYPES = ("?", "u1", "i1", "u2", "i2", "f2", "u4", "i4", "f4", "u8", "i8", "f8")
NAMED_ARRAYS = st.dictionaries(
    st.text(st.characters(codec="utf-8"), max_size=8).filter(lambda name: name != "__metadata__"),
    st.sampled_from(DTYPES).flatmap(
        lambda dtype: arrays_of.arrays(
            dtype, arrays_of.array_shapes(min_dims=0, min_side=0, max_side=3)
        )
    ),
    max_size=4,
)
TEXTS = st.dictionaries(st.text(max_size=5), st.text(st.characters(codec="utf-8"), max_size=5))
ARRAYS = {"b": np.arange(3, dtype=np.uint8), "a": np.arange(4.0).reshape(2, 2)}


def assert_same(found, expected):
    assert found.keys() == expected.keys()
    for name, array in expected.items():
        assert found[name].dtype == array.dtype
        assert found[name].shape == array.shape
        assert found[name].tobytes() == array.tobytes()  # NaN included


@settings(max_examples=40, deadline=None)
@given(arrays=NAMED_ARRAYS, metadata=TEXTS)
def test_everything_comes_back(arrays, metadata):
    found, texts = from_bytes(to_bytes(arrays, metadata))
    assert_same(found, arrays)
    assert texts == metadata


@settings(max_examples=40, deadline=None)
@given(arrays=NAMED_ARRAYS, metadata=TEXTS)
def test_the_library_reads_ours_and_we_read_the_librarys(arrays, metadata):
    library = pytest.importorskip("safetensors.numpy")
    ours = to_bytes(arrays, metadata)
    assert_same(library.load(ours), arrays)
    found, texts = from_bytes(library.save(arrays, metadata or None))
    assert_same(found, arrays)
    assert texts == metadata


def test_the_library_lays_bytes_out_alike():
    library = pytest.importorskip("safetensors.numpy")
    ours, theirs = to_bytes(ARRAYS, {"seed": "3"}), library.save(ARRAYS, {"seed": "3"})
    sizes = [int.from_bytes(data[:8], "little") for data in (ours, theirs)]
    headers = [json.loads(d[8 : 8 + n]) for d, n in zip((ours, theirs), sizes, strict=True)]
    assert headers[0] == headers[1]
    assert ours[8 + sizes[0] :] == theirs[8 + sizes[1] :]


def test_order_strides_and_byte_order_do_not_matter():
    expected = to_bytes(ARRAYS, {"x": "1", "y": "2"})
    big = {"a": ARRAYS["a"].astype(">f8"), "b": np.repeat(ARRAYS["b"], 2)[::2]}
    assert to_bytes(big, {"y": "2", "x": "1"}) == expected
    assert int.from_bytes(expected[:8], "little") % 8 == 0


def test_what_is_read_may_be_written_to():
    found, _ = from_bytes(to_bytes(ARRAYS, {}))
    found["a"][0] = 7


@pytest.mark.parametrize("array", [np.array(["text"]), np.array([None]), np.zeros(1, complex)])
def test_types_that_the_format_lacks_are_refused(array):
    with pytest.raises(InputError, match="'x' of type"):
        to_bytes({"x": array}, {})


def test_the_metadatas_name_is_taken():
    with pytest.raises(InputError, match="__metadata__"):
        to_bytes({"__metadata__": np.zeros(1)}, {})


def test_no_prefix_is_taken_for_the_whole():
    whole = to_bytes(ARRAYS, {"x": "1"})
    for size in range(len(whole)):
        with pytest.raises(InputError, match="tensors"):
            from_bytes(whole[:size])
    with pytest.raises(InputError, match="announced"):
        from_bytes(whole + b"\0")


def entry(**changes):
    return {"dtype": "F64", "shape": [1], "data_offsets": [0, 8]} | changes


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ([], "JSON object"),
        ({"a": [0, 8]}, "needs dtype"),
        ({"a": entry() | {"more": 1}}, "needs dtype"),
        ({"a": entry(dtype="O")}, "dtype 'O'; valid: BOOL"),
        ({"a": entry(dtype=["F64"])}, "valid: BOOL"),
        ({"a": entry(shape=[2])}, "not the bytes"),
        ({"a": entry(shape=[-1])}, "integers from 0"),
        ({"a": entry(shape=[True])}, "integers from 0"),
        ({"a": entry(shape="1")}, "integers from 0"),
        ({"a": entry(shape=[1.0])}, "integers from 0"),
        ({"a": entry(data_offsets=[8, 0])}, "not the bytes"),
        ({"a": entry(data_offsets=[0])}, "not the bytes"),
        ({"a": entry(data_offsets=[0, 8, 8])}, "not the bytes"),
        ({"a": entry(data_offsets=[8, 16])}, "begins at byte 8"),
        ({"a": entry(), "b": entry()}, "begins at byte 0 instead of 8"),
        ({"a": entry(), "b": entry(data_offsets=[8, 16])}, "16 bytes of arrays announced"),
        ({}, "0 bytes of arrays announced, 8 found"),
        ({"a": entry(), "b": entry(shape=[0, 10**30], data_offsets=[8, 8])}, "no array can have"),
        ({"a": entry(), "__metadata__": {"x": 1}}, "__metadata__"),
        ({"a": entry(), "__metadata__": 1}, "__metadata__"),
    ],
)
def test_a_bad_header_is_refused(header, words):
    text = json.dumps(header).encode()
    with pytest.raises(InputError, match=words):
        from_bytes(len(text).to_bytes(8, "little") + text + bytes(8))


@pytest.mark.parametrize("text", [b"{", b"\xff", b'{"a": 1, "a": 1}', b"[" * 100_000, b""])
def test_a_header_that_is_no_json_is_refused(text):
    with pytest.raises(InputError, match="not valid JSON"):
        from_bytes(len(text).to_bytes(8, "little") + text)


@given(data=st.binary(max_size=40), size=st.integers(0, 60))
def test_arbitrary_bytes_are_read_or_refused(data, size):
    try:
        from_bytes(size.to_bytes(8, "little") + data)
    except InputError as error:
        assert str(error).startswith("tensors: ")
