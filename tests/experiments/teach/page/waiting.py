"""How long a page takes, seen by the page itself, and how loaded the machine is meanwhile."""

import time
from pathlib import Path

import numpy as np
import pytest

Error = pytest.importorskip("playwright.sync_api", reason="no playwright: pip install it").Error

IDLE = 0.0125
"""What `load` measures on an idle machine [s]."""
CLOCK = """
([key, done]) => new Promise((resolve, reject) => {
  const began = performance.now(), is = new Function('return ' + done);
  const seen = new MutationObserver(() => {
    if (!is()) return;
    seen.disconnect();
    resolve(performance.now() - began);
  });
  seen.observe(document, { subtree: true, attributes: true, childList: true });
  setTimeout(() => reject(new Error(`${key}: ${done} does not come`)), 60000);
  window.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
})
"""
"""Presses a key, and gives the milliseconds until the page shows that something is done."""
MOTION = """
key => new Promise((resolve, reject) => {
  const began = performance.now(), viewer = document.querySelector('iframe').contentWindow.viewer;
  const { handle_command, render } = viewer, was = new Map();
  let moved = false;
  viewer.handle_command = (told) => {
    const now = told.type === 'set_transform' && told.matrix.join();
    if (now && was.has(told.path) && was.get(told.path) !== now) moved = true;
    if (now) was.set(told.path, now);
    handle_command.call(viewer, told);
  };
  viewer.render = () => {
    render.call(viewer);
    if (!moved) return;
    delete viewer.handle_command;
    delete viewer.render;
    resolve(performance.now() - began);
  };
  setTimeout(() => reject(new Error(`${key}: nothing moves`)), 20000);
  window.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
})
"""
"""Presses a key, and gives the milliseconds until the 3D view has drawn something that moved."""
TOKEN = "document.querySelector('[data-teach=question]').dataset.token"


def load():
    """How much longer a fixed piece of work takes than on an idle machine; 1 at least."""
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        np.sort(np.random.default_rng(0).random(150_000))
        spent.append(time.perf_counter() - began)
        time.sleep(0.01)
    return max(1.0, max(spent) / IDLE)


def spent(pid):
    """Processor time of a process and its threads so far [s]."""
    tasks = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(each.read_text().split()[0]) for each in tasks) / 1e9


def right(world, one, rng):
    """What the oracle says to the question shown, the favourite if that is as good."""
    state, favourite = int(one.asked("state")), one.asked("favourite")
    if world.oracle.terminal[state]:
        return -1
    good = world.oracle.optimal_actions[state]
    if favourite not in (None, "", "-1") and good[int(favourite)]:
        return int(favourite)
    return world.oracle.label(state, rng)


def enter(one):
    """Press Enter; the seconds until the next question stands there."""
    began, token = time.monotonic(), one.asked("token")
    try:
        waited = one.page.evaluate(CLOCK, ["Enter", f"{TOKEN} !== '{token}'"])
    except Error as error:  # the page lost its connection and loads anew
        print(f"a wait was lost: {error}")
        one.wait_for_another(token)
        return time.monotonic() - began
    return waited / 1e3
