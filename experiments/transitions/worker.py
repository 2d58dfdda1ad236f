"""What a worker process does: trials, each from its own seed, on one rig that it keeps."""

from functools import cache

import numpy as np

from diagrams.trials.arm import ArmRig, run_arm_trial
from diagrams.trials.database import ARM, Campaign
from diagrams.trials.floating import run_trial
from diagrams.trials.record import Pair, TrialConfig, TrialRecord, spawn_key
from diagrams.trials.rig import TrialRig
from experiments.kit.shipped_data import load_planner


def work(campaign: Campaign, pair: Pair, repetition: int) -> TrialRecord:
    """Run one trial in this process.

    Args:
        campaign: what all its trials have in common.
        pair: what is tried.
        repetition: counts the trials of the pair's class.
    """
    sequence = np.random.SeedSequence(campaign.seed, spawn_key=spawn_key(pair, repetition))
    if campaign.rig == ARM:
        return run_arm_trial(_arm_rig(campaign.trial), campaign.trial, pair, sequence)
    return run_trial(_floating_rig(campaign.trial), campaign.trial, pair, sequence)


def release(
    trial: TrialConfig, pair: Pair, angle: float, seed: int, repetition: int
) -> TrialRecord:
    """Run a drop of a cube that hangs turned about the closing axis, by an angle [rad] and noise.

    The noise of a repetition is the same at every angle, so that angles are compared like for like.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=spawn_key(pair, repetition))
    return run_trial(_floating_rig(trial), trial, pair, sequence, turned=angle)


@cache
def _floating_rig(trial: TrialConfig) -> TrialRig:
    return TrialRig(trial)


@cache
def _arm_rig(trial: TrialConfig) -> ArmRig:
    return ArmRig(load_planner(), trial)
