from dataclasses import fields

import pytest

from irl.baselines.action_advice import AdviceConfig
from irl.baselines.ascent import RidgeConfig
from irl.baselines.bellman_gradient import BellmanGradientConfig
from irl.baselines.birl import SamplingConfig
from irl.baselines.deep_max_ent import DeepMaxEntConfig
from irl.baselines.linear_mlirl import MlirlConfig
from irl.baselines.lp_advice import TrustConfig
from irl.baselines.sparse_planning import SparseConfig
from irl.errors import InputError

SETTINGS = (
    AdviceConfig,
    BellmanGradientConfig,
    DeepMaxEntConfig,
    MlirlConfig,
    RidgeConfig,
    SamplingConfig,
    SparseConfig,
    TrustConfig,
)
FREE = {"hidden", "hardness", "smoothing"}  # no numbers, or any number


@pytest.mark.parametrize(
    ("settings", "field"),
    [(s, f.name) for s in SETTINGS for f in fields(s) if f.name not in FREE],
)
def test_every_number_has_its_limits(settings, field):
    with pytest.raises(InputError, match=f"^{field}: must be"):
        settings(**{field: -1})
