"""Trials in another Python, such as one with another release of Drake: asked and answered in JSON.

``python -m experiments.transitions.trust.elsewhere`` says its versions in a first line, then
answers each line, a trial to run, by one with its record. It needs no torch.

Until 1.50 Drake takes the limit of an actuator's effort from the model file alone. There the file,
as it is read, says what the scene asks for in a call, so that the scene is the same.
"""

import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, replace
from importlib.metadata import version
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuator

from diagrams.trials import rig
from diagrams.trials.database import Campaign
from diagrams.trials.record import Noise, Outcome, Pair, TrialConfig, TrialRecord
from experiments.kit.executors import Workers
from experiments.transitions.worker import work
from irl.errors import InputError
from models.errors import ModelError
from models.scenes.parsing import DESCRIPTION, strict_parser

ROOT = Path(__file__).parents[3]


class OtherPython:
    """A process of another Python that runs trials, one at a time."""

    def __init__(self, python: Path) -> None:
        """Start it.

        Args:
            python: the interpreter of an environment with Drake and what the models need.

        Raises:
            InputError: if it does not start, or the scene does not run there.
        """
        self.python = python
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        try:
            self._process = subprocess.Popen(
                [python, "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
                text=True,
            )
        except OSError as error:
            self._errors.close()
            raise InputError(
                f"{python}: does not start ({error.strerror})", place="--pythons"
            ) from error
        self.versions: dict[str, str] = self._answer()
        """Of Python and packages, by name."""

    def run(self, campaign: Campaign, pair: Pair, repetition: int) -> TrialRecord:
        """Run one trial there.

        Raises:
            InputError: if the process ends.
        """
        assert self._process.stdin is not None
        job = [campaign.content(), pair.state, pair.action, repetition]
        try:
            self._process.stdin.write(json.dumps(job) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass  # it has ended, and told why
        return _to_record(self._answer())

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
        self._errors.close()

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if line:
            return json.loads(line)
        self._process.wait()
        self._errors.seek(0)
        told = self._errors.read().decode(errors="replace").strip().splitlines()
        raise InputError(
            f"{self.python}: no trial runs there ({told[-1] if told else 'it ended'})",
            place="--pythons",
        )


class _Elsewhere(Executor):
    """Runs trials in processes of another Python; whatever is submitted is a trial's `work`."""

    def __init__(self, processes: list[OtherPython]) -> None:
        self._threads = ThreadPoolExecutor(len(processes))
        self._idle: SimpleQueue[OtherPython] = SimpleQueue()
        for process in processes:
            self._idle.put(process)

    def submit(  # type: ignore[override]
        self, function: Callable[..., TrialRecord], /, *job: Any
    ) -> Future[TrialRecord]:
        assert function is work
        return self._threads.submit(self._run, *job)

    def _run(self, campaign: Campaign, pair: Pair, repetition: int) -> TrialRecord:
        process = self._idle.get()
        try:
            return process.run(campaign, pair, repetition)
        finally:
            self._idle.put(process)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._threads.shutdown(wait, cancel_futures=cancel_futures)


@contextmanager
def start_elsewhere(python: Path, workers: int) -> Iterator[tuple[Workers, dict[str, str]]]:
    """Run trials in processes of another Python; with its versions.

    Raises:
        InputError: as `OtherPython`.
    """
    processes: list[OtherPython] = []
    try:
        while len(processes) < workers:
            processes.append(OtherPython(python))
        executor = _Elsewhere(processes)
        try:
            yield Workers(executor, lambda: workers), processes[0].versions
        finally:
            executor.shutdown(wait=False, cancel_futures=True)
    finally:
        for process in processes:
            process.close()


def _to_record(answer: dict[str, Any]) -> TrialRecord:
    record = TrialRecord(**answer)
    return replace(
        record,
        outcome=Outcome(record.outcome),
        turn=tuple(record.turn),
        displacement=tuple(record.displacement),
        noise=Noise(**answer["noise"]) if answer["noise"] else None,
    )


def trial_config(content: dict[str, Any]) -> TrialConfig:
    """How a campaign's trials run, out of its content as stored.

    Raises:
        ModelError: if this release runs trials otherwise.
    """
    settings: dict[str, Any] = {"solver": "discrete"} | {  # which has no name in the content
        name: tuple(value) if isinstance(value, list) else value
        for name, value in content["trial"].items()
    }
    try:
        return TrialConfig(**settings)
    except TypeError as error:
        raise ModelError(f"the campaign's trial has other settings ({error})") from error


def _say_limits_in_file() -> None:
    """Where an actuator's limit cannot be set, let the gripper's file say what the scene asks."""
    if hasattr(JointActuator, "set_effort_limit"):
        return
    asked: dict[str, float] = {}
    plain = rig.add_models

    def ask(actuator: JointActuator, limit: float) -> None:
        asked[actuator.joint().name()] = limit

    def add_models(plant: MultibodyPlant, *files: str) -> None:
        for file in files:
            text = (DESCRIPTION / file).read_text()
            for joint, limit in asked.items():
                pattern = rf'(<joint name="{joint}".*?effort=")[^"]*'
                text = re.sub(pattern, rf"\g<1>{limit!r}", text, flags=re.DOTALL)
            if text == (DESCRIPTION / file).read_text():
                plain(plant, file)
            else:
                strict_parser(plant).AddModelsFromString(text, file.rpartition(".")[2])

    JointActuator.set_effort_limit = ask
    discrete = TrialConfig(solver="discrete")  # which every release has
    rig.TrialRig(discrete)  # tells what the scene asks for
    rig.add_models = add_models
    plant = rig.TrialRig(discrete).plant
    for joint, limit in asked.items():
        assert plant.GetJointActuatorByName(joint).effort_limit() == limit


def main() -> None:
    """Answer trials until there are none."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever else is printed is no answer
    _say_limits_in_file()
    packages = {name: version(name) for name in ("drake", "numpy", "scipy")}
    print(json.dumps(packages | {"python": platform.python_version()}), file=answers, flush=True)
    for line in sys.stdin:
        content, state, action, repetition = json.loads(line)
        campaign = Campaign(**content | {"trial": trial_config(content)})
        record = work(campaign, Pair(state, action), repetition)
        print(json.dumps(asdict(record)), file=answers, flush=True)


if __name__ == "__main__":
    main()
