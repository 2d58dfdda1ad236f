"""Work that resumes: what it kept must be its own, and is refused with one wording if it isn't."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from irl.errors import InputError

ABSENT = "nothing"
"""What a message shows of a setting that one side lacks."""


def require_same_work(
    path: Path, found: Mapping[str, Any], wanted: Mapping[str, Any], remedy: str = ""
) -> None:
    """Refuse what an earlier run kept in ``path``, if it was a run of other settings or data.

    Both sides are compared as JSON holds them, so that a tuple equals the list it was saved as.

    Args:
        path: the file that was found.
        found: what the earlier run says of itself: settings, and hashes of its inputs, by name.
        wanted: what this run says of itself.
        remedy: what to do instead; by default to delete the file, or to name another.

    Raises:
        InputError: naming all that differs, there and here.
    """
    there, here = _plain(found), _plain(wanted)
    differing = [
        f"{name} ({_brief(there, name)} there, {_brief(here, name)} here)"
        for name in sorted(there.keys() | here.keys())
        if there.get(name) != here.get(name)
    ]
    if differing:
        raise InputError(
            f"kept by other work, differing in {', '.join(differing)}; "
            f"{remedy or 'run with the former settings, delete it, or name another'}",
            place=str(path),
        )


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    return json.loads(json.dumps(dict(values)))


def _brief(values: Mapping[str, Any], name: str) -> str:
    """A value as a message shows it: long ones, such as hashes, by their beginning."""
    text = json.dumps(values[name]) if name in values else ABSENT
    return text if len(text) <= 40 else f"{text[:13]}…"
