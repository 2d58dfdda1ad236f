"""What a worker process does: trials, each from its own seed, on one rig that it keeps."""

from functools import cache

import numpy as np

from diagrams.arm_trial import ArmRig, run_arm_trial
from diagrams.grasp_trial import run_trial
from diagrams.trial_database import ARM, Campaign
from diagrams.trial_record import Pair, TrialRecord
from diagrams.trial_rig import TrialRig
from experiments.robot_data import load_planner


def work(campaign: Campaign, pair: Pair, repetition: int) -> TrialRecord:
    """Run one trial in this process.

    Args:
        campaign: what all its trials have in common.
        pair: what is tried.
        repetition: counts the trials of the pair's class.
    """
    sequence = np.random.SeedSequence(
        campaign.seed, spawn_key=(pair.state, pair.action, repetition)
    )
    if campaign.rig == ARM:
        return run_arm_trial(_arm_rig(campaign.trial.time_step), campaign.trial, pair, sequence)
    return run_trial(_floating_rig(campaign.trial.time_step), campaign.trial, pair, sequence)


@cache
def _floating_rig(time_step: float) -> TrialRig:
    return TrialRig(time_step)


@cache
def _arm_rig(time_step: float) -> ArmRig:
    return ArmRig(load_planner(), time_step)
