"""The three parts of a window, drawn by the browser from plain values."""

from collections.abc import Callable
from typing import Any

from nicegui.element import Element
from nicegui.events import GenericEventArguments

Plain = dict[str, Any]


class _Part(Element):
    """Values that are sent again only where they changed."""

    def tell(self, **values: Any) -> None:
        """Show values."""
        new = {name: value for name, value in values.items() if self._props.get(name) != value}
        if new:
            self._props.update(new)
            self.update()


class View(_Part, component="view.js"):
    """The 3D view, or the grid."""


class Question(_Part, component="question.js"):
    """The question, and every key; what a window says comes from here."""

    def on_say(self, hear: Callable[[Plain], Plain]) -> None:
        """Give messages to ``hear``, and the window what comes back."""

        def take(event: GenericEventArguments) -> None:
            if isinstance(event.args, dict):
                reply = hear(event.args)
                if reply:
                    self.run_method("told", reply)

        self.on("say", take)


class Panels(_Part, component="panels.js"):
    """What stands below the question."""
