"""Joint angles for a pose of the hand, verified and collision-free.

`solver` answers, for any arm: an `IkSolution` with joint angles, or the `Failure` that says why
there are none (`solution`). The Gen3 goes by its closed form (`sweep`), the Gen3 Lite by its
polynomial (`roots`), other arms and constraints of the user's own by Newton's method and Drake's
optimiser (`optimised`). `arm_frames` is where such an arm sits in a scene.
"""

from models.inverse_kinematics.solution import Failure, IkSolution
from models.inverse_kinematics.solver import IkSolver, solve

__all__ = ["Failure", "IkSolution", "IkSolver", "solve"]
