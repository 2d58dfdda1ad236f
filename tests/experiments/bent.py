"""Files and what is in them, bent: some bytes, a number, a field, a row otherwise."""

import csv
import io
import json
import math
import warnings
import zipfile

import numpy as np

HOSTILE = [
    *(None, True, -1, 0, 1, 7, 10**6, 2**31, 2**63, -(2**70), 10**400, 0.5, -0.0, 1e308),
    *(math.nan, math.inf, "", "x", "١", "-1", "01", "1e3", "../../etc/passwd", "\0", "a\nb"),
    *([], {}, [[]], [0, 0], [-1], {"a": 1}, "x" * 1000, 1 + 1e-8),
]
DTYPES = ["<i1", "<i4", "<i8", "<u8", "<f4", "<f8", ">f8", "<c16", "?", "<U3", "V3", "<M8[s]"]


def pick(rng, choices):
    """One of a list, of whatever kinds."""
    return choices[int(rng.integers(len(choices)))]


def bent_bytes(data, rng):
    """Bits turned, bytes lost, repeated or put in, or another beginning."""
    at, to = np.sort(rng.integers(0, len(data) + 1, 2)).tolist()
    kind = rng.integers(6)
    if kind == 0 and data:
        at = min(at, len(data) - 1)
        return data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
    noise = rng.bytes(int(rng.integers(1, 20)))
    return [
        data[:at],
        data[:at],
        data[:at] + data[to:],
        data[:to] + data[at:],
        data[:at] + noise + data[at:],
        noise + data[8:],
    ][kind]


def bent_json(text, rng):
    """A value replaced, left out or added somewhere; a key given twice; a nest."""
    value = json.loads(text)
    kind = rng.integers(8)
    if kind == 0:
        key = pick(rng, list(value)) if value else "a"
        return text.replace("{", f"{{{json.dumps(key)}: {json.dumps(pick(rng, HOSTILE))},", 1)
    if kind == 1:
        return "[" * 100_000

    def bend(value):
        if isinstance(value, (dict, list)) and value and rng.random() < 0.8:
            key = pick(rng, list(value) if isinstance(value, dict) else range(len(value)))
            if rng.random() < 0.2:
                del value[key]
            else:
                value[key] = bend(value[key])
            return value
        if isinstance(value, dict) and rng.random() < 0.5:
            return value | {str(pick(rng, HOSTILE)): pick(rng, HOSTILE)}
        if isinstance(value, list) and rng.random() < 0.5:
            return [*value, pick(rng, [*HOSTILE, *value])]
        return pick(rng, HOSTILE)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return json.dumps(bend(value))


def bent_array(array, rng):
    """Another type, shape, length or element."""
    kind = rng.integers(5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if kind == 0:
                return array.astype(pick(rng, DTYPES))
            if kind == 1:
                return array[..., None] if rng.random() < 0.5 else array.ravel()
            if kind == 2:
                return array[: int(rng.integers(len(array) + 1))]
            if kind == 3:
                return np.concatenate([array, array[-1:]])
            flat = array.copy().ravel()
            flat[rng.integers(flat.size)] = pick(rng, HOSTILE)
            return flat.reshape(array.shape)
        except (ValueError, TypeError, OverflowError):
            return array[:0]


def bent_arrays(arrays, rng):
    """One array bent, left out, renamed, or one more."""
    name = pick(rng, sorted(arrays))
    kind = rng.integers(8)
    if kind == 0:
        return {k: v for k, v in arrays.items() if k != name}
    if kind == 1:
        return {(str(pick(rng, HOSTILE)) if k == name else k): v for k, v in arrays.items()}
    if kind == 2:
        return {**arrays, str(pick(rng, HOSTILE)): np.arange(3)}
    return {**arrays, name: bent_array(arrays[name], rng)}


def bent_npz(data, rng):
    """Arrays bent, a member twice, or one that is no array."""
    with np.load(io.BytesIO(data)) as file:
        arrays = bent_arrays({name: file[name] for name in file.files}, rng)
    made = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        warnings.simplefilter("ignore")
        for name, array in arrays.items():
            made_of = io.BytesIO()
            np.save(made_of, array, allow_pickle=True)
            content, member = made_of.getvalue(), f"{name}.npy".replace("\0", "?")
            if rng.random() < 0.1:
                content = bent_bytes(content, rng)
            archive.writestr(member, content)
            if rng.random() < 0.05:
                archive.writestr(member, content)
    return made.getvalue()


def bent_csv(text, rng):
    """A cell replaced, rows or columns lost, repeated or exchanged."""
    rows = list(csv.reader(io.StringIO(text)))
    at, other = rng.integers(0, len(rows), 2).tolist()
    kind = rng.integers(6)
    if kind == 0:
        del rows[at]
    elif kind == 1:
        rows.insert(other, list(rows[at]))
    elif kind == 2:
        rows[at], rows[other] = rows[other], rows[at]
    elif kind == 3:
        column = int(rng.integers(len(rows[0])))
        rows = [[c for k, c in enumerate(row) if k != column] for row in rows]
    elif rows[at]:
        # What stands elsewhere does more harm than what can stand nowhere.
        column = int(rng.integers(len(rows[at])))
        values = [row[column] for row in rows if column < len(row)]
        rows[at][column] = str(pick(rng, HOSTILE if kind == 4 else values))
    made = io.StringIO()
    csv.writer(made, lineterminator="\n").writerows(rows)
    return made.getvalue()


def bent_file(name, data, rng):
    """A file's bytes damaged, or what it says."""
    suffix = name.rpartition(".")[2]
    if rng.random() < 0.25 or suffix not in ("json", "npz", "csv"):
        return bent_bytes(data, rng)
    if suffix == "npz":
        return bent_npz(data, rng)
    bend = bent_json if suffix == "json" else bent_csv
    return bend(data.decode(), rng).encode("utf-8", "surrogatepass")
