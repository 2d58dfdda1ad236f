import os
import signal

import pytest

from models.errors import ModelError
from models.export.precomputed import require_precomputed
from models.maps import lite_csv, reachability_csv
from models.scenes.setup import read_setup


@pytest.fixture
def within_20_s():
    """Whoever waits for a pipe that nobody writes to is interrupted."""
    signal.alarm(20)
    yield
    signal.alarm(0)


@pytest.mark.parametrize("thing", ["pipe", "folder", "absent", "latin-1"])
@pytest.mark.parametrize(
    "read",
    [read_setup, require_precomputed, reachability_csv.read_map, lite_csv.read_map],
    ids=["setup", "trajectory", "map", "map of the Lite"],
)
def test_what_is_no_text_file_is_refused_by_name_and_not_waited_for(
    tmp_path, within_20_s, read, thing
):
    path = tmp_path / "given"
    if thing == "pipe":
        os.mkfifo(path)
    elif thing == "folder":
        path.mkdir()
    elif thing == "latin-1":
        path.write_bytes("Würfel".encode("latin-1"))
    with pytest.raises(ModelError) as refused:
        read(path)
    assert str(refused.value).startswith(f"{path}: ") and "valid: a " in str(refused.value)
