"""What a worker process does: trials, each from its own seed, on one rig that it keeps."""

from functools import cache

import numpy as np

from diagrams.grasp_trial import run_trial
from diagrams.trial_record import Pair, TrialConfig, TrialRecord
from diagrams.trial_rig import TrialRig


def work(config: TrialConfig, seed: int, pair: Pair, repetition: int) -> TrialRecord:
    """Run one trial in this process.

    Args:
        config: course and noise.
        seed: of the campaign; the trial's own follows from it, the pair and the repetition.
        pair: what is tried.
        repetition: counts the trials of the pair's class.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(pair.state, pair.action, repetition))
    return run_trial(_rig(config.time_step), config, pair, sequence)


@cache
def _rig(time_step: float) -> TrialRig:
    return TrialRig(time_step)
