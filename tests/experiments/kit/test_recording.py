"""What a recording's page holds: the cube's places, cuts between episodes, captions."""

import re
from base64 import b64decode

import numpy as np
import pytest

from experiments.kit.recording import captions, write_recording
from models.task.spaces import GOAL_STATE, POSITIONS
from tests.experiments.kit.still import FAR, NEAR, still


def test_a_recording_cuts_between_episodes(tmp_path):
    """No picture of it lies between the end of an episode and the start of the next."""
    msgpack = pytest.importorskip("msgpack")
    page = tmp_path / "recording.html"
    write_recording(page, [still(FAR), still(NEAR)], ["first", "second"], GOAL_STATE)
    html = page.read_text()
    cells = [POSITIONS[state.position][:2] for state in (FAR, NEAR)]
    places = cube_places(html, msgpack)
    frames = sorted(places)
    at = [int(np.linalg.norm(places[frame] - cells, axis=1).argmin()) for frame in frames]
    (cut,) = np.flatnonzero(np.diff(at))
    assert frames[cut + 1] - frames[cut] == 1
    # The last scene was held for a second.
    assert frames[cut] - frames[cut - 1] == pytest.approx(23, abs=1)
    for told in ("first", "second", "grasp", "by forecast"):
        assert told in html


def cube_places(html, msgpack):
    """Where a recording shows the cube ``[2]`` [m], by frame, out of what its page plays."""
    packed = re.findall(r"application/octet-binary;base64,([A-Za-z0-9+/=]+)", html)
    commands = [
        msgpack.unpackb(b64decode(each)) for each in packed if b"set_animation" in b64decode(each)
    ]
    (command,) = [each for each in commands if each["type"] == "set_animation"]
    (track,) = [
        track
        for animation in command["animations"]
        if animation["path"].endswith("/cube/cube")
        for track in animation["clip"]["tracks"]
        if track["name"] == ".position"
    ]
    return {key["time"]: np.array(key["value"][:2]) for key in track["keys"]}


def test_captions_tell_the_start_each_action_with_what_chose_it_and_the_result():
    lost = captions(still(FAR), "Episode 1 of 3")
    assert [each.since for each in lost] == [0.0, 0.5, 1.5, 2.0]
    assert all(each.text.startswith("Episode 1 of 3\n") for each in lost)
    assert "by forecast" in lost[1].text and "→" in lost[2].text
    assert lost[-1].text.endswith("lost, after 1 action")
    assert captions(still(FAR, success=True), "E")[-1].text.startswith("E\nthe goal is reached")
