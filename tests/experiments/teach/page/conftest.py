"""The page in a real browser: Debian's chromium, led by playwright; skipped where it is not."""

import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


class Teaching:
    """A lesson in a folder, and the server that teaches it, by some Python from some folder."""

    def __init__(self, folder, *options, python=sys.executable, root=ROOT):
        self.lesson = folder / "lesson.db"
        self._python, self._root = str(python), root
        self._folder, self._options = folder, options
        self._log = folder / "server.log"
        self.port, self.process, self.printed = 0, None, ""

    def start(self):
        """Start the server; it listens when this is over."""
        command = [self._python, "-m", "experiments.teach", "--no-browser", *self._options]
        command += ["--port", str(self.port), "--out", str(self._folder)]
        with self._log.open("ab") as log:
            before = log.tell()
            self.process = subprocess.Popen(
                command,
                cwd=self._root,
                stdout=log,
                stderr=log,
                env=os.environ | {"OMP_NUM_THREADS": "1"},
            )
        for _ in range(6000):  # whoever compiles first takes minutes on a busy machine
            told = self.log[before:]
            if (found := re.search(r"teach at (http://\S+:(\d+)/\S*)  ", told)) is not None:
                self.printed, self.port = found[1], int(found[2])
                return self
            assert self.process.poll() is None, told
            time.sleep(0.05)
        raise AssertionError(f"the server did not start: {self.log}")

    @property
    def log(self):
        return self._log.read_text()

    @property
    def url(self):
        return f"http://127.0.0.1:{self.port}/"

    def learner(self):
        """Process id of the learner, once there is one: a child of the server's."""
        command = ["ps", "-ww", "-o", "pid=,args=", "--ppid", str(self.process.pid)]
        for _ in range(600):
            told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            found = [int(line.split()[0]) for line in told.splitlines() if "spawn_main" in line]
            if found:
                return found[-1]
            time.sleep(0.05)
        raise AssertionError(told)

    def kill(self):
        """As a power cut does."""
        self.process.kill()
        self.process.wait()

    def stop(self):
        """As Ctrl-C does."""
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.kill()
                raise

    def events(self, kind):
        """Rows of the lesson's file of a kind, as JSON texts."""
        address = f"file:{self.lesson}?mode=ro"
        with closing(sqlite3.connect(address, uri=True, timeout=10)) as database:
            return [row[0] for row in database.execute(
                "select content from event where kind = ? order by number", (kind,)
            )]  # fmt: skip


@pytest.fixture
def teaching(tmp_path):
    """Makes lessons, and ends their servers."""
    made = []

    def make(*options):
        made.append(Teaching(tmp_path, *options))
        return made[-1]

    yield make
    for each in made:
        each.stop()


@pytest.fixture(scope="session")
def start_teaching():
    """Starts the server of a lesson in a folder."""
    return lambda folder, *options: Teaching(folder, *options).start()


@contextmanager
def chromium():
    """A browser; the test is skipped where there is none."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright: pip install it")
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("no chromium: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield found
        found.close()


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


class Window:
    """One window that looks on a page, and what a person does there."""

    def __init__(self, browser, url, size=(1280, 720), scale=1.0, known=True):
        self.context = browser.new_context(
            viewport={"width": int(size[0] / scale), "height": int(size[1] / scale)},
            device_scale_factor=scale,
        )
        self.page = self.context.new_page()
        self.errors, self.abroad, self.reloads = [], [], []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda message: self._note_said(message.type, message.text))
        self.page.on("request", lambda r: self._note(r.url, url.partition("?")[0]))
        self.page.set_default_timeout(120_000)
        self.page.goto(url)
        if known:
            self.page.wait_for_selector("[data-token]")
            self.page.wait_for_function("window.did_handshake")

    def _note_said(self, kind, text):
        if kind == "error":
            self.errors.append(text)
        elif text.startswith("reloading"):
            self.reloads.append(text)

    def _note(self, url, own):
        if not url.startswith((own, own.replace("http", "ws"), "data:", "blob:")):
            self.abroad.append(url)

    def press(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)

    def read(self, part):
        return self.page.inner_text(f"[data-teach={part}]")

    def asked(self, name):
        """Of the question: token, state, favourite, chosen."""
        return self.page.get_attribute("[data-teach=question]", f"data-{name}")

    @property
    def phase(self):
        return self.page.get_attribute("[data-teach=view]", "data-phase")

    def wait_for(self, condition, *given):
        """Wait for a JavaScript condition of ``given``."""
        self.page.wait_for_function(condition, arg=list(given))

    def wait_until_asked(self):
        self.wait_for("() => document.querySelector('[data-phase]')?.dataset.phase === 'asking'")

    def wait_for_another(self, token):
        """Wait for another question than the one of ``token``."""
        self.wait_for(
            "([t]) => ![t, undefined].includes("  # a page that loads anew has none for a while
            "document.querySelector('[data-teach=question]')?.dataset.token)",
            token,
        )

    def choose(self, action):
        """By the keyboard where it has a key, else with the mouse, in place of many arrows."""
        if self.asked("chosen") == str(action):
            return
        if action == -1:
            self.press("d")
        else:
            self.page.evaluate("a => document.querySelector(`[data-a='${a}']`).click()", action)
        self.wait_for(
            "([a]) => document.querySelector('[data-teach=question]').dataset.chosen == a", action
        )

    def answer(self, action):
        """Choose and answer; the next question is there when this is over."""
        token = self.asked("token")
        self.choose(action)
        self.press("Enter")
        self.wait_for_another(token)


@pytest.fixture
def window(browser):
    """Opens windows, and closes them."""
    opened = []

    def open_one(url, **options):
        opened.append(Window(browser, url, **options))
        return opened[-1]

    yield open_one
    for each in opened:
        each.context.close()
