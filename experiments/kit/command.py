"""What every command shares: options in, results out, a user's mistake reported in one line."""

import contextlib
import dataclasses
import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import yaml

from experiments.kit.interruption import INTERRUPTED, interrupt_as_usual
from experiments.kit.options import LARGEST_SEED, OptionError, name_option, parse
from experiments.kit.running import alone_in
from irl.choices import check_range
from irl.errors import InputError, first_line
from irl.files import atomic_path
from models.errors import ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Config = TypeVar("Config")
BAD_INPUT = 2


def _fail(message: str) -> "SystemExit":
    print(f"error: {message}", file=sys.stderr)
    return SystemExit(BAD_INPUT)


def _plain(value: Any) -> Any:
    """Turn a configuration or result into what YAML and JSON can hold."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    return value


class Output:
    """A command's output folder: made on entry, so that an unwritable one costs no work."""

    def __init__(self, folder: Path, config: Any) -> None:
        """Create ``folder``; leave nothing behind if that fails.

        Raises:
            InputError: if the folder cannot be created or written.
        """
        self.folder = Path(folder)
        self._config = config
        missing = [p for p in (self.folder, *self.folder.parents) if not p.exists()]
        self._created: list[Path] = []
        try:
            for path in reversed(missing):
                path.mkdir()
                self._created.append(path)
            tempfile.TemporaryFile(dir=self.folder).close()
        except OSError as error:
            self.discard()
            raise InputError(
                f"--out {self.folder}: cannot be written ({error.strerror}); give a writable folder"
            ) from error

    def discard(self) -> None:
        """Remove the folders this run made, as far as they are still empty."""
        for path in reversed(self._created):
            with contextlib.suppress(OSError):
                path.rmdir()

    @contextlib.contextmanager
    def file(self, name: str) -> Iterator[Path]:
        """Yield a temporary path that becomes ``name`` in the folder when the block succeeds."""
        with atomic_path(self.folder / name) as path:
            yield path

    @contextlib.contextmanager
    def figure(self, name: str, dpi: int = 120) -> Iterator["Figure"]:
        """Yield an empty figure that becomes the picture ``name`` when the block succeeds.

        Whoever draws sets its size. It is made without pyplot, so that it needs no display, and
        nothing keeps it once it is saved.
        """
        from matplotlib.figure import Figure  # noqa: PLC0415 - slow, and not all commands draw

        figure = Figure(layout="constrained")
        yield figure
        with self.file(name) as path:
            figure.savefig(path, dpi=dpi)

    def write_config(self) -> None:
        """Save the whole effective configuration, defaults included, as ``config.yaml``."""
        with self.file("config.yaml") as path:
            path.write_text(yaml.safe_dump(_plain(self._config), sort_keys=False))

    def write_result(self, result: dict[str, Any]) -> None:
        """Save the figures as ``result.json``."""
        with self.file("result.json") as path:
            path.write_text(json.dumps(_plain(result), indent=2, allow_nan=False) + "\n")


def execute(
    config_type: type[Config],
    main: Callable[[Config, Output], dict[str, Any]],
    arguments: list[str] | None = None,
) -> None:
    """Run a command as a person does: parse, work, leave ``config.yaml`` and ``result.json``.

    ``main(config, output)`` returns what goes into ``result.json``. A mistake of the user
    ends in one line on stderr and exit code 2; a defect of ours keeps its traceback; Ctrl-C ends it
    without a word and exit code 130. Only one command at a time works in a folder, but for those
    whose configuration has a true ``looks_on``, which only tell what others did.
    """
    interrupt_as_usual()
    try:
        config = parse(config_type, arguments)
    except OptionError as error:
        raise _fail(str(error)) from None
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
    try:
        check_range("--seed", getattr(config, "seed", 0), 0, LARGEST_SEED)
        output = Output(config.out, config)  # type: ignore[attr-defined]
        looks_on = getattr(config, "looks_on", False)
        try:
            with contextlib.nullcontext() if looks_on else alone_in(output.folder):
                result = main(config, output)
                output.write_config()
                output.write_result(result)
        except BaseException:
            output.discard()
            raise
    except (InputError, ModelError) as error:
        raise _fail(name_option(str(error), type(config))) from None
    except OSError as error:
        raise _fail(f"{error.filename or 'input or output'}: {error.strerror or error}") from error
    except MemoryError as error:
        told = f" ({first_line(error)})" if str(error) else ""
        raise _fail(f"not enough memory{told}; choose less of what needs it") from error
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None
