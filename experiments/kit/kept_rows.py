"""Rows of a result that are done, kept in the output folder until all are: work that resumes."""

from collections.abc import Mapping
from typing import Any

from experiments.kit.command import Output
from irl.errors import InputError
from irl.formats import read_json, write_json
from irl.identity import require_same_work

KEPT = "measured.json"


class KeptRows:
    """Rows on disk while a command runs; the same command finds them again after a kill.

    Attributes:
        rows: those done so far, in order.
    """

    def __init__(self, output: Output, identity: Mapping[str, Any]) -> None:
        """Take up what an interrupted run left in the output folder.

        Args:
            output: of the command.
            identity: settings that the rows depend on, by name.

        Raises:
            InputError: if that run was of another configuration, or the file is damaged.
        """
        self._output, self._identity = output, dict(identity)
        self._path = output.folder / KEPT
        self.rows: list[dict[str, Any]] = []
        if not self._path.exists():
            return
        kept = read_json(self._path)
        fields = kept if isinstance(kept, dict) else {}
        if not (isinstance(fields.get("config"), dict) and isinstance(fields.get("rows"), list)):
            raise InputError(
                "fields 'config' and 'rows' are needed; delete it", place=str(self._path)
            )
        require_same_work(self._path, kept["config"], self._identity)
        self.rows = kept["rows"]

    def add(self, row: dict[str, Any]) -> None:
        """Keep one row more."""
        self.rows.append(row)
        with self._output.file(KEPT) as temporary:
            write_json(temporary, {"config": self._identity, "rows": self.rows})

    def forget(self) -> None:
        """Remove the file: the result is about to say it all."""
        self._path.unlink(missing_ok=True)
