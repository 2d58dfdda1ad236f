"""Why an action could not be carried out: a name that retries and results go by."""

from enum import StrEnum


class ActionFailure(StrEnum):
    """What kept an action from being carried out.

    The first four are known before anything moves; the others end a motion that is under way, so
    that the same action may well succeed at the next try.
    """

    UNFIT = "unfit"
    """It does not fit the state: such as a grasp of a cube that is held already."""
    OUT_OF_REACH = "out of reach"
    """No posture of the arm has the hand where it is to go."""
    NO_ROOM = "no room"
    """Something is in the way where the hand, or what it holds, is to go."""
    NO_PATH = "no path"
    """No free way was found to where there is room."""
    DISPLACED = "displaced"
    """The cube moved before the fingers closed on it."""
    GRIP_LOST = "grip lost"
    """The hand no longer holds what it was carrying, or closed on nothing."""
    OBSTRUCTED = "obstructed"
    """The arm does not follow: something is in its way, or pulls at it."""
    OVERTIME = "overtime"
    """The arm did not arrive in time."""

    @property
    def is_foreseen(self) -> bool:
        """Whether it was known before anything moved, and will be the same from there again."""
        return self in _FORESEEN


_FORESEEN = {
    ActionFailure.UNFIT,
    ActionFailure.OUT_OF_REACH,
    ActionFailure.NO_ROOM,
    ActionFailure.NO_PATH,
}


class Infeasible(Exception):  # noqa: N818 - an answer rather than an error
    """The action cannot be carried out; the message says why.

    Attributes:
        failure: of what kind that is.
    """

    def __init__(self, failure: ActionFailure, reason: str) -> None:
        """Answer with a kind and a reason for a person."""
        super().__init__(reason)
        self.failure = failure
