"""The postures that the vendor names, in radians.

From the SRDF files of Kinova's ros_kortex: ``gen3_robotiq_2f_85.srdf.xacro`` (7 joints) and
``gen3_lite_gen3_lite_2f.srdf.xacro``; ros2_kortex has the same ``home``, ``retract`` and
``vertical`` of the Gen3. They print two to four decimals, and π and π/2 as 3.14 and 1.57: here
these are exact. ``home`` is what the arm's own action "Home" does, (0, 15, 180, 230, 0, 55, 90)
degrees, to 0.1 degree.
"""

import numpy as np

from models.errors import ModelError
from models.scenes.robots import GEN3, GEN3_LITE

POSTURES: dict[str, dict[str, np.ndarray]] = {
    "gen3": {
        "home": GEN3.home,
        "retract": np.array([0.0, -0.35, np.pi, -2.54, 0.0, -0.87, np.pi / 2]),
        "vertical": np.zeros(7),
        "left_snapshot": np.array([-1.75, 1.05, 1.05, np.pi / 2, 0.0, 1.05, 2.8]),
        "right_snapshot": np.array([1.75, 1.05, -1.05, np.pi / 2, 0.0, 1.05, 0.45]),
        "top_snapshot": np.array([0.043, -0.1824, -0.0133, 2.208, -0.0188, 0.7828, -1.524]),
    },
    "gen3_lite": {
        "home": GEN3_LITE.home,
        # The vendor prints 2.6199 for joint 3, above the 2.61 of its own description.
        "retract": np.array([-0.0522, 0.3664, 2.61, -1.536, -0.6981, -1.5184]),
        "vertical": np.zeros(6),
    },
}
"""Joint angles by robot and name; ask `posture`, which gives copies."""


def posture(name: str, robot: str = "gen3") -> np.ndarray:
    """Joint angles ``[n]`` [rad] of a posture by the vendor's name for it.

    Args:
        name: ``home``, ``retract`` or ``vertical``; of the Gen3 also ``left_snapshot``,
            ``right_snapshot`` and ``top_snapshot``.
        robot: ``gen3`` or ``gen3_lite``.

    Raises:
        ModelError: if there is no such robot or posture.
    """
    if robot not in POSTURES:
        raise ModelError(f"robot {robot!r}; valid: {', '.join(POSTURES)}")
    if name not in POSTURES[robot]:
        raise ModelError(f"posture {name!r} of {robot}; valid: {', '.join(POSTURES[robot])}")
    return POSTURES[robot][name].copy()
