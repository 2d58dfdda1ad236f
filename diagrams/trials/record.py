"""What a grasp trial is told and what it reports: plain records, nothing of the simulator."""

import math
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, NamedTuple, get_args

from diagrams.contact import RESTITUTIONS, TIME_STEP, Solver
from diagrams.falls.scene import ACCURACY
from diagrams.faults import first_line
from diagrams.gripper_controller import FINGER_INERTIA
from models.errors import ModelError
from models.task.pairs import pair_key, split_key
from models.task.trial_classes import TrialClasses

_SECONDS = {"time_step": 0.1, "close_s": 60.0, "settle_s": 60.0, "release_s": 60.0}
_ACCURACY = (1e-9, 0.1)
_NUMBERS = {
    "accuracy": _ACCURACY,
    "turning_accuracy": _ACCURACY,
    "creeping_accuracy": _ACCURACY,
    "landing_accuracy": _ACCURACY,
    "finger_inertia": (0.0, 1.0),
    "position_sd": (0.0, 1.0),
    "yaw_sd": (0.0, math.pi),
    "tilt_sd": (0.0, math.pi),
    "rest_limit_s": (0.0, 600.0),
}
_CENIC = (*(n for n in _NUMBERS if "accuracy" in n), "finger_inertia", "restitution")
"""What the discrete solver does not ask for."""
_RANGES = {"friction": (1e-6, 10.0), "mass": (1e-300, 100.0), "restitution": RESTITUTIONS}


@dataclass(frozen=True)
class TrialConfig:
    """Everything that decides a trial's outcome besides its pair and seed.

    The noise stands for what a real cell does to an action that repeats: perception and
    placement errors of a few millimetres and degrees, pads that wear, cubes that differ.
    """

    solver: Solver = "cenic"
    """What simulates the floating gripper, and cubes that fall in either scene: Drake's CENIC, an
    integrator that controls its error by the length of its steps, or the discrete solver, whose
    steps are all equal. With CENIC alone a cube that is let go lands blow by blow. Whatever the
    whole arm does besides is simulated by the discrete solver."""
    time_step: float = TIME_STEP
    """The time step of the discrete solver [s]; the whole arm has its own."""
    accuracy: float = 2e-4
    """The accuracy of CENIC while the hand closes, holds and carries."""
    turning_accuracy: float = 1.5e-4
    """The accuracy of CENIC in trials that turn the hand."""
    creeping_accuracy: float = 1e-6
    """The finest accuracy of CENIC where a cube does not lie still in the closed hand: the trial
    begins anew with ever finer ones, until it does or is out of the hand. By a coarse one fingers
    keep what they squeeze out by a fine one."""
    landing_accuracy: float = ACCURACY
    """The accuracy of CENIC while a cube falls, lands and comes to rest."""
    finger_inertia: float = FINGER_INERTIA
    """The inertia of each moving part of the fingers about its joint, beside its own, for CENIC
    [kg m²]."""
    position_sd: float = 0.002
    """How far the cube lies off the gripper's target, in x and y: a standard deviation [m]."""
    yaw_sd: float = 0.05
    """How far a free cube is turned off its orientation: a standard deviation [rad]."""
    tilt_sd: float = 0.02
    """How far a held cube is turned in the pads, and the gripper tilted: likewise [rad]."""
    friction: tuple[float, float] = (0.6, 0.9)
    """The range of the coefficient of friction of cube, pads and table, drawn uniformly."""
    mass: tuple[float, float] = (0.08, 0.12)
    """The range of the cube's mass, drawn uniformly [kg]."""
    restitution: tuple[float, float] = (0.4, 0.6)
    """The range of the coefficient of restitution of cube and table, drawn uniformly.
    Tables give 0.5 for wood on wood and 0.60 for a wooden ball on a hard floor (The Physics
    Factbook, "Coefficients of restitution", 2006); it differs from wood to wood (J. Soc. Mat. Sci.
    Japan 71, 603, 2022). The discrete solver cannot resolve a blow and leaves it to the models."""
    close_s: float = 1.3
    """The time from the command to close until the lift [s]."""
    settle_s: float = 0.3
    """The time of rest after a motion, before the state is identified [s]."""
    release_s: float = 1.6
    """The time from the command to open until the gripper withdraws, wide open [s]."""
    rest_limit_s: float = 3.0
    """The longest wait for a released cube to come to rest [s]."""

    def content(self) -> dict[str, Any]:
        """What decides how trials come out, by name: so too for campaigns older than CENIC."""
        own = asdict(self)
        if self.solver == "discrete":
            for name in ("solver", *_CENIC):
                del own[name]
        return own

    def __post_init__(self) -> None:
        """Refuse what cannot be simulated, by a ModelError that names the field and its choices."""
        if self.solver not in get_args(Solver):
            valid = ", ".join(get_args(Solver))
            raise ModelError(f"trial: solver is {self.solver!r}; give one of {valid}")
        for name, most in _SECONDS.items():
            if not 0.0 < getattr(self, name) <= most:
                raise ModelError(
                    f"trial: {name} is {getattr(self, name)}; give seconds above 0, up to {most:g}"
                )
        for name, (least, most) in _NUMBERS.items():
            if not least <= getattr(self, name) <= most:
                raise ModelError(
                    f"trial: {name} is {getattr(self, name)}; give {least:g} to {most:g}"
                )
        for name, (least, most) in _RANGES.items():
            low, high = getattr(self, name)
            if not least <= low <= high <= most:
                raise ModelError(
                    f"trial: {name} is {low}, {high}; give two numbers from {least:g} to "
                    f"{most:g}, the lower first"
                )


@dataclass(frozen=True, order=True)
class Pair:
    """What is tried.

    Attributes:
        state: index of the nominal state that the trial begins in.
        action: index of the action.
    """

    state: int
    action: int

    @classmethod
    def from_key(cls, key: int) -> "Pair":
        """The pair of a key of `models.task.pairs`."""
        state, action = split_key(key)
        return cls(int(state), int(action))

    @property
    def key(self) -> int:
        """Its key in `models.task.pairs`."""
        return int(pair_key(self.state, self.action))

    def number(self, classes: TrialClasses) -> int:
        """Number of the class that it shares its trials with."""
        return int(classes.number(self.state, self.action))


def spawn_key(pair: Pair, repetition: int) -> tuple[int, int, int]:
    """What sets a trial's seed apart from those of a campaign's other trials.

    The trial draws from ``numpy.random.SeedSequence(campaign seed, spawn_key=…)``.
    """
    return pair.state, pair.action, repetition


@dataclass(frozen=True)
class Noise:
    """Every random quantity of a trial.

    Attributes:
        x: of the cube's place against the gripper's target [m].
        y: the same across.
        yaw: of a free cube against its nominal orientation [rad].
        turn_about_closing: of a held cube, between the pads [rad].
        gripper_roll: of the hand about the world's x [rad].
        gripper_pitch: the same about y.
        friction: coefficient, of everything.
        mass: of the cube [kg].
        restitution: coefficient, of cube and table; None where it was left to the model files.
    """

    x: float
    y: float
    yaw: float
    turn_about_closing: float
    gripper_roll: float
    gripper_pitch: float
    friction: float
    mass: float
    restitution: float | None = None


class Outcome(StrEnum):
    """What became of the cube."""

    HELD = "held"
    FREE = "free"
    FAULT = "fault"


@dataclass(frozen=True)
class TrialRecord:
    """A trial's outcome and the numbers behind it; world axes, metres, radians, newtons.

    Attributes:
        outcome: `HELD` or `FREE`; `FAULT` if the simulator failed, which judges nothing.
        next_state: index of the state identified at the end, −1 after a fault.
        turn: rotation vector of R_WO_after · R_WOᵀ, from the nominal orientation.
        displacement: of the cube's centre at the end, from where the action would leave it: its
            place on the table before a grasp, the hand's cell before a drop, the target cell of
            a motion.
        snap_angle: from the cube's orientation to the nearest of the 48.
        drift: horizontal part of the displacement.
        lift_height: of the cube's centre above where it would rest on the table.
        clearance: smallest distance of the hand from the table, between the phases of the trial.
        slip: motion of the cube in the hand during the lift, or while it was held.
        in_hand_rotation: turn of the cube against the gripper over the same time.
        pad_force: force of each pad before the lift or the release.
        opening: of the pads at that moment.
        speed: of the cube when the outcome was read [m/s].
        noise: what was drawn last; None if nothing was.
        draws: how often, until the hand held the cube that it is to begin with.
        fault: why nothing was judged, in the first line; below it the traceback if the simulator
            failed. Empty if there was no fault.
        cpu_s: processor time [s]; not part of the outcome.
    """

    outcome: Outcome
    next_state: int = -1
    turn: tuple[float, ...] = (0.0, 0.0, 0.0)
    displacement: tuple[float, ...] = (0.0, 0.0, 0.0)
    snap_angle: float = 0.0
    drift: float = 0.0
    lift_height: float = 0.0
    clearance: float = 0.0
    slip: float = 0.0
    in_hand_rotation: float = 0.0
    pad_force: float = 0.0
    opening: float = 0.0
    speed: float = 0.0
    noise: Noise | None = None
    draws: int = 1
    fault: str = ""
    cpu_s: float = 0.0

    @property
    def reason(self) -> str:
        """Why nothing was judged, in one line; empty if something was."""
        return first_line(self.fault)


class Trial(NamedTuple):
    """A trial that was run.

    Attributes:
        pair: what was tried.
        repetition: counts the trials of the pair's class.
        record: what came of it.
    """

    pair: Pair
    repetition: int
    record: TrialRecord
