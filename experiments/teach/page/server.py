"""The page's server: one process that alone writes the lesson, with a learner beside it."""

import asyncio
import logging
import secrets
import socket
import warnings
import webbrowser
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import uvicorn
from fastapi import FastAPI
from nicegui import ui
from pydrake.geometry import Meshcat, MeshcatParams, Rgba

from diagrams.state_view import StateView
from experiments.kit.shipped_data import load_planner
from experiments.teach.desk import Desk, DeskConfig
from experiments.teach.page.board import Board, RobotReasons, grid_reasons
from experiments.teach.page.guard import Guard, is_local
from experiments.teach.page.learner import ProcessLearner
from experiments.teach.page.motions import GridMotions, Motions, RobotMotions
from experiments.teach.page.parts import Panels, Question, View
from experiments.teach.page.playing import Playing
from experiments.teach.page.proxy import MeshcatProxy
from experiments.teach.page.room import Room
from experiments.teach.rounds import Learner, LocalLearner
from experiments.teach.worlds import World
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_replay import config_of
from irl.student import Student
from models.task.spaces import N_ACTIONS

CSS = Path(__file__).with_name("page.css")
GRACE = 2
"""How long open windows may take to be told of the end [s]."""
PATIENCE = 120.0
"""A window that lost its connection is waited for as long as this [s]."""
CAMERA = ([0.98, -0.62, 0.98], [0.47, 0.0, 0.66])
"""Where the 3D view stands and looks at first [m]."""


@dataclass(frozen=True)
class Address:
    """Where the page is.

    Attributes:
        host: what it is bound to; elsewhere than on this machine it wants a token.
        port: 0 for any that is free.
        browser: whether to open it.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    browser: bool = True


@dataclass(frozen=True)
class Subject:
    """What is taught, and how to make it once more in the learner's process.

    Attributes:
        world: what is taught.
        build: a function of a module that makes it, of ``arguments``.
        arguments: see there.
    """

    world: World
    build: Callable[..., World]
    arguments: tuple


def serve(
    subject: Subject,
    lesson: Lesson,
    config: DeskConfig,
    at: Address,
    prepare: Callable[[Desk], None] = lambda desk: None,
) -> Desk:
    """Teach in a browser until the program is interrupted; the desk as it was left.

    Args:
        subject: what is taught.
        lesson: its file.
        config: how it is led.
        at: where the page is.
        prepare: is given the desk before anybody looks at it.

    Raises:
        InputError: if the address is taken, or cannot be bound to.
    """
    listener = _listen(at)
    port = listener.getsockname()[1]
    token = "" if is_local(at.host) else secrets.token_urlsafe(24)
    page = _Page(subject, lesson, config, prepare)
    app = FastAPI(lifespan=page.lifespan, docs_url=None, redoc_url=None, openapi_url=None)
    page.add_to(app)
    ui.run_with(
        app,
        title=f"Teach: {lesson.path.name}",
        reconnect_timeout=PATIENCE,
        show_welcome_message=False,
    )
    url = f"http://{_name(at.host)}:{port}/" + (f"?token={token}" if token else "")
    print(f"teach at {url}  (Ctrl-C ends; every answer is kept in {lesson.path})", flush=True)
    if at.browser:
        webbrowser.open(url)
    guarded = Guard(app, port=port, token=token)
    settings = uvicorn.Config(
        guarded,
        log_level="warning",
        ws_max_size=2**20,
        ws_ping_timeout=PATIENCE,  # a browser on a busy machine may be deaf for a while
        timeout_graceful_shutdown=GRACE,
    )
    server = uvicorn.Server(settings)
    # The framework looks for its server among all objects, some of which mind being looked at.
    warnings.filterwarnings("ignore", category=FutureWarning, module="nicegui")
    with suppress(KeyboardInterrupt):
        server.run(sockets=[listener])
    assert page.desk is not None
    return page.desk


def _name(host: str) -> str:
    """What a browser calls the address that the page is bound to."""
    if host in ("0.0.0.0", "::"):  # all that this machine has
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host


def _listen(at: Address) -> socket.socket:
    try:
        family = socket.getaddrinfo(at.host, at.port, type=socket.SOCK_STREAM)[0][0]
        listener = socket.socket(family, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((at.host, at.port))
        listener.listen()  # whoever comes before the page is ready waits for it
    except OSError as error:
        raise InputError(
            f"cannot listen there ({error.strerror}); give another --port, or 0 for a free one",
            place=f"{at.host}:{at.port}",
        ) from None
    return listener


class _Page:
    """What the windows have in common, made when the event loop runs."""

    def __init__(
        self,
        subject: Subject,
        lesson: Lesson,
        config: DeskConfig,
        prepare: Callable[[Desk], None],
    ) -> None:
        self._subject, self._lesson, self._config = subject, lesson, config
        self._prepare = prepare
        model = subject.world.model
        self._is_robot = model.n_actions == N_ACTIONS
        self.desk: Desk | None = None
        self.room: Room | None = None
        self._proxy: MeshcatProxy | None = None
        if self._is_robot:
            logging.getLogger("drake").setLevel(logging.WARNING)
            self._meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
            _furnish(self._meshcat)
            self._proxy = MeshcatProxy(self._meshcat.web_url())
            self._view = StateView(self._meshcat, load_planner(), self._outcomes)
            # Whoever comes first does not wait until the planner is compiled.
            self._view.preview(*(int(each[0]) for each in (model.pair_state, model.pair_action)))

    def add_to(self, app: FastAPI) -> None:
        """Add the page, and the view under its address."""
        if self._proxy is not None:
            self._proxy.add_to(app)
        ui.page("/")(self._window)

    @asynccontextmanager
    async def lifespan(self, app: FastAPI) -> AsyncIterator[None]:
        """Open the room, and close it at the end."""
        del app
        learner = self._learner()
        process = learner if isinstance(learner, ProcessLearner) else None
        if process is not None:
            process.link.start()
        world = self._subject.world
        self.desk = desk = Desk(world, self._lesson, learner, self._config)
        self._prepare(desk)
        motions, playing = self._motions(desk)
        board = Board(world, RobotReasons() if self._is_robot else grid_reasons)
        self.room = room = Room(desk, board, motions, playing)
        if desk.question is not None:
            motions.show(desk.question.state)
        ticking = asyncio.get_running_loop().create_task(room.keep_ticking())
        try:
            yield
        finally:
            ticking.cancel()
            room.close()
            if process is not None:
                process.link.close()
            if playing is not None:
                playing.link.close()
            if self._proxy is not None:
                await self._proxy.close()

    def _learner(self) -> Learner:
        subject, lesson = self._subject, self._lesson
        config = config_of(lesson, subject.world.subject)
        if self._config.synchronous:
            return LocalLearner(Student(subject.world.subject, config, lesson.initial))
        return ProcessLearner(subject.build, subject.arguments, config, lesson.initial, self._tick)

    def _tick(self) -> None:
        if self.room is not None:
            self.room.tick()

    def _changed(self) -> None:
        if self.room is not None:
            self.room.changed()

    def _motions(self, desk: Desk) -> tuple[Motions, Playing | None]:
        world = desk.world
        if not self._is_robot:
            grid = GridMotions(world, self._changed)
            grid.look_at(desk)
            return grid, None
        robot = RobotMotions(self._view, world)
        return robot, Playing(desk, robot, self._changed)

    def _outcomes(self, state: int, action: int) -> list[tuple[int, float]]:
        """What may come of an action, the likeliest first."""
        model = self._subject.world.model
        row = model.P[[int(model.pair_index(state, action))]]
        order = (-row.data).argsort(kind="stable")
        return [(int(row.indices[i]), float(row.data[i])) for i in order]

    def _window(self) -> None:
        """One window: it looks on until it is gone for good."""
        room = self.room
        assert room is not None
        ui.add_css(CSS)
        with ui.element("main").classes("teach"):
            view = View()
            with ui.element("div").classes("side"):
                question, panels = Question(), Panels()
        question.on_say(room.hear)
        loop = asyncio.get_running_loop()
        waiting = False

        def refresh() -> None:
            nonlocal waiting
            waiting = False
            seen = room.snapshot()
            question.tell(question=seen["question"], state=seen["state"])
            view.tell(view=seen["view"], state=seen["state"])
            panels.tell(panels=seen["panels"], progress=seen["progress"], state=seen["state"])

        def look() -> None:
            nonlocal waiting
            if not waiting:
                waiting = True
                loop.call_soon(refresh)

        refresh()
        ui.context.client.on_delete(room.look_on(look))


def _furnish(meshcat: Meshcat) -> None:
    """A quiet room, and the nine columns drawn on the table."""

    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Background/<object>", "top_color", [0.97, 0.98, 0.99])
    meshcat.SetProperty("/Background/<object>", "bottom_color", [0.80, 0.83, 0.87])
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 1.1)
    meshcat.SetProperty("/Cameras/default/rotated/<object>", "zoom", 1.0)
    meshcat.SetCameraPose(*CAMERA)
    x, y, z = np.array([0.475, 0.525, 0.575, 0.625]), np.array([-0.15, -0.05, 0.05, 0.15]), 0.5012
    start = [*((a, y[0], z) for a in x), *((x[0], b, z) for b in y)]
    end = [*((a, y[-1], z) for a in x), *((x[-1], b, z) for b in y)]
    meshcat.SetLineSegments(
        "/columns", np.array(start).T, np.array(end).T, 2.0, Rgba(0.55, 0.45, 0.3, 1.0)
    )
