"""The recording opened from disk, as a person does, in Chromium; left out where there is none."""

import shutil

import numpy as np
import pytest

from experiments.kit.recording import write_recording
from models.task.spaces import GOAL_STATE
from tests.experiments.kit.still import FAR, NEAR, still

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
AT = (
    "t => {const a = viewer.animator; a.pause(); a.display_progress(t); a.seek(t); viewer.render()}"
)


@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_three_episodes_are_small_and_play_from_disk_with_captions_and_a_camera_that_follows(
    tmp_path,
):
    playwright = pytest.importorskip("playwright.sync_api")
    file = tmp_path / "recording.html"
    # As long as episodes are, and in no picture does anything stand where it stood before.
    played = [still(FAR, 30.0), still(NEAR, 30.0), still(FAR, 30.0, success=True)]
    for each in played:
        each.frames[:] += 1e-3 * np.sin(np.arange(len(each.frames)))[:, None]
    write_recording(file, played, ["first", "second", "third"], GOAL_STATE)
    assert file.stat().st_size < 10e6
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        page = browser.new_page(viewport={"width": 640, "height": 400})
        wrong = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(file.as_uri())
        page.wait_for_function("window.viewer && viewer.animator.actions.length > 0")
        told, looked = [], []
        shown = (("first", "grasp", 1.0), ("second", "", 32.0), ("third", "goal is reached", 92.5))
        for title, words, time in shown:
            page.evaluate(AT, time)
            # The caption follows with the next picture.
            page.wait_for_function(
                "([title, words]) => { const text = document.getElementById('caption').textContent;"
                " return text.startsWith(title) && text.includes(words); }",
                arg=[title, words],
            )
            told.append(page.locator("#caption").inner_text())
            target = page.evaluate("viewer.controls.target.toArray()")
            looked.append(np.array(target))
        goal = page.evaluate("viewer.scene_tree.find(['drake', 'goal']).object !== undefined")
        browser.close()
    assert not wrong and goal
    assert [text.split("\n")[0] for text in told] == ["first", "second", "third"]
    assert "grasp" in told[0] and "the goal is reached" in told[2]
    # The cube lies elsewhere in the second episode: the camera looks there.
    assert np.linalg.norm(looked[1] - looked[0]) > 0.03
    assert np.linalg.norm(looked[2] - looked[0]) < 0.01
