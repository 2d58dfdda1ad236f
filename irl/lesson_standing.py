"""What was said in a lesson and still holds: undo and edits, done.

An edit stands in the place of what it edits. To undo an edit gives back what it changed; to undo an
undo is not offered, since what was undone can be said again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from irl.choices import check_choice
from irl.errors import InputError
from irl.lesson_events import (
    Advised,
    Answered,
    Cluster,
    Edit,
    Event,
    Excluded,
    Imported,
    Skipped,
    Undo,
)

EDITABLE: Mapping[type, tuple[str, ...]] = {
    Answered: ("action",),
    Advised: ("preferred", "avoided"),
    Excluded: ("pairs",),
    Imported: ("advice",),
}
SAID = (Answered, Advised, Cluster, Excluded, Skipped, Edit, Imported)
"""What a person said, and may take back."""


def stands(events: Sequence[Event]) -> dict[int, Event]:
    """Number → event of all that was said and still holds, edits done, in order.

    An edit stands in the place of what it edits and has no place of its own.

    Raises:
        InputError: if an event takes back or edits what is not there to be.
    """
    said: dict[int, Event] = {}
    edits: dict[int, list[tuple[int, dict]]] = {}
    for number, event in enumerate(events, start=1):
        if isinstance(event, Undo):
            if not 1 <= event.of < number or not isinstance(events[event.of - 1], SAID):
                raise InputError(f"undoes {event.of}, which nobody said", place=f"event {number}")
            taken = events[event.of - 1]
            if isinstance(taken, Edit):
                left = [each for each in edits.get(taken.of, []) if each[0] != event.of]
                edits[taken.of] = left
            else:
                said.pop(event.of, None)
        elif isinstance(event, Edit):
            edited = events[event.of - 1] if 1 <= event.of < number else None
            if type(edited) not in EDITABLE:
                raise InputError(
                    f"edits {event.of}, which cannot be edited", place=f"event {number}"
                )
            for name in event.changes:
                check_choice(f"event {number}: edit", name, EDITABLE[type(edited)])
            edits.setdefault(event.of, []).append((number, event.changes))
        elif isinstance(event, SAID):
            said[number] = event
    for number, changes in edits.items():
        for _, change in changes:
            if number in said:
                said[number] = replace(said[number], **change)
    return said


def last_said(events: Sequence[Event]) -> int | None:
    """The number of the last thing said that was not taken back; None if there is none left."""
    undone = {event.of for event in events if isinstance(event, Undo)}
    for number in range(len(events), 0, -1):
        if isinstance(events[number - 1], SAID) and number not in undone:
            return number
    return None
