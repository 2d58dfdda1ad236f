"""What the server does before anybody comes."""

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")

from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.teach.desk import DeskConfig
from experiments.teach.page import server
from experiments.teach.page.server import Address, Subject, serve
from experiments.teach.worlds import robot_world


class StoppedError(Exception):
    """In place of serving."""


def test_the_planner_is_compiled_before_the_address_is_told(monkeypatch, capsys, tmp_path):
    told = []

    class View:
        def __init__(self, *given):
            pass

        def preview(self, state, action):
            told.append(capsys.readouterr().out)
            assert action in world.model.actions_of(state)

    def stop(*given, **named):
        raise StoppedError

    world = robot_world(SHIPPED_TASK)
    monkeypatch.setattr(server, "StateView", View)
    monkeypatch.setattr(server, "load_planner", lambda: None)
    monkeypatch.setattr(server.uvicorn.Server, "run", stop)
    lesson = SimpleNamespace(path=tmp_path / "lesson.db")
    subject = Subject(world, robot_world, (SHIPPED_TASK,))
    with pytest.raises(StoppedError):
        serve(subject, lesson, DeskConfig(), Address(port=0, browser=False))
    assert len(told) == 1 and "teach at" not in told[0]
    assert "teach at http://127.0.0.1:" in capsys.readouterr().out
