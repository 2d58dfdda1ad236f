"""Commands that are interrupted, killed, short of disk, or two in one folder."""

import os
import resource
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from experiments.kit.command import execute
from experiments.kit.running import LOCK, alone_in
from irl.errors import InputError
from irl.files import atomic_path

ROOT = Path(__file__).parents[3]


@dataclass
class Config:
    """A command for tests."""

    out: Path = field(default_factory=lambda: Path("out"))
    """Folder of the results."""


def script(folder, body):
    """A process that runs a command of this body, and says so when it has begun."""
    head = """
import sys, time
from dataclasses import dataclass
from pathlib import Path
import experiments.kit.command as command
from experiments.kit.executors import start_workers

@dataclass
class Config:
    out: Path
    looks_on = False
"""
    (folder / "story.py").write_text(
        f"{head}\ndef main(config, output):\n{body}\n    return {{}}\n\n"
        f"if __name__ == '__main__':\n"
        f"    command.execute(Config, main, ['--out', {str(folder / 'out')!r}])\n"
    )
    return subprocess.Popen(
        [sys.executable, str(folder / "story.py")],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for(path, process):
    deadline = time.monotonic() + 60
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


DRAWS = """
    with output.file('plot.png') as path:
        path.write_text('half')
        (output.folder / 'begun').write_text('')
        time.sleep(60)
"""


def test_a_second_run_in_a_folder_names_the_first_until_it_is_killed(tmp_path, capsys):
    first = script(tmp_path, DRAWS)
    out = tmp_path / "out"
    wait_for(out / "begun", first)
    with pytest.raises(SystemExit) as stop:
        execute(Config, lambda *_: {}, ["--out", str(out)])
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith(f"error: --out {out}: process {first.pid}, since 2")

    # What it has begun is not touched while it lives, and cleared once it was killed.
    (half,) = out.glob(".plot.png.*.png")
    first.kill()
    first.communicate()
    assert half.exists()
    execute(Config, lambda *_: {}, ["--out", str(out)])
    assert sorted(path.name for path in out.iterdir()) == ["begun", "config.yaml", "result.json"]


def test_what_a_living_process_writes_is_left_alone(tmp_path):
    with atomic_path(tmp_path / "plot.png") as path:
        path.write_text("half")
        with alone_in(tmp_path):
            assert path.read_text() == "half"
    assert (tmp_path / "plot.png").read_text() == "half"


@pytest.mark.parametrize(
    "name", [".bashrc.backup01", ".hidden", "plot.png.abcd1234.png", ".plot.png.backup.png", ".a.b"]
)
def test_files_of_a_persons_own_are_left_alone(tmp_path, name):
    (tmp_path / name).write_text("mine")
    with alone_in(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_looking_on_is_allowed_while_another_runs(tmp_path):
    @dataclass
    class Looking(Config):
        """Tells what others did."""

        looks_on = True

    with alone_in(tmp_path):
        execute(Looking, lambda *_: {}, ["--out", str(tmp_path)])
        with pytest.raises(InputError, match="process"), alone_in(tmp_path):
            pass
        assert (tmp_path / LOCK).exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["config.yaml", "result.json"]


def test_a_file_system_without_locks_does_no_harm(tmp_path, monkeypatch):
    def unsupported(*_):
        raise OSError(95, "Operation not supported")

    (tmp_path / ".plot.png.abcd1234.png").write_text("whose is it?")
    monkeypatch.setattr("fcntl.flock", unsupported)
    with alone_in(tmp_path), atomic_path(tmp_path / "table.csv") as path:
        path.write_text("a\n")
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == [".plot.png.abcd1234.png", "table.csv"]


def test_a_full_disk_names_the_file_and_leaves_nothing(tmp_path, capsys):
    """A limit on the size of files stands for the disk: the same call fails the same way."""

    def work(_, output):
        with output.file("policy.bin") as path:
            path.write_bytes(bytes(100_000))
        return {}

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with pytest.raises(SystemExit) as stop:
            execute(Config, work, ["--out", str(tmp_path / "out")])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert stop.value.code == 2
    assert capsys.readouterr().err == f"error: {tmp_path}/out/policy.bin: File too large\n"
    assert list(tmp_path.iterdir()) == []


def test_too_little_memory_is_one_line(tmp_path, capsys):
    def work(*_):
        raise MemoryError("Unable to allocate 7.28 TiB")

    with pytest.raises(SystemExit) as stop:
        execute(Config, work, ["--out", str(tmp_path / "out")])
    assert stop.value.code == 2
    assert "Unable to allocate 7.28 TiB" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


WORKERS = """
    with start_workers(2) as pool:
        jobs = [pool.executor.submit(time.sleep, 0) for _ in range(4)]
        [job.result() for job in jobs]
        Path(output.folder.parent / 'begun').write_text('')
        jobs = [pool.executor.submit(time.sleep, 60) for _ in range(8)]
        [job.result() for job in jobs]
"""
ALONE = """
    Path(output.folder.parent / 'begun').write_text('')
    time.sleep(60)
"""
STARTING = """
    with start_workers(2) as pool:
        Path(output.folder.parent / 'begun').write_text('')
        jobs = [pool.executor.submit(time.sleep, 60) for _ in range(8)]
        [job.result() for job in jobs]
"""


@pytest.mark.parametrize(
    "body", [ALONE, WORKERS, STARTING], ids=["alone", "workers", "workers that import"]
)
def test_ctrl_c_is_quiet_quick_and_leaves_nothing(tmp_path, body):
    """The signal reaches every process of the terminal, the workers as well."""
    process = script(tmp_path, body)
    wait_for(tmp_path / "begun", process)
    if body == STARTING:
        time.sleep(0.3)
    began = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)
    said = process.communicate(timeout=30)
    assert time.monotonic() - began < 10
    assert (process.returncode, *said) == (130, "", "")
    assert not (tmp_path / "out").exists()
    deadline = time.monotonic() + 10
    while living(process.pid):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def living(group):
    """Processes of a group that have not ended, whether or not they were waited for."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, of = path.read_text().rpartition(")")[2].split()[:3]
        except OSError:
            continue
        if of == str(group) and state != "Z":
            found.append(path)
    return found


def test_ctrl_c_is_quiet_while_a_command_is_imported(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", IMPORTING, str(tmp_path / "begun")],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for(tmp_path / "begun", process)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=30)
    assert (process.returncode, *said) == (130, "", "")


IMPORTING = """
import builtins, runpy, sys
begun, real = sys.argv[1], builtins.__import__
def told(name, *rest, **more):
    if name == "numpy":
        open(begun, "w").close()
    return real(name, *rest, **more)
builtins.__import__ = told
sys.argv = ["-m"]
runpy.run_module("experiments.demo", run_name="__main__", alter_sys=True)
"""
