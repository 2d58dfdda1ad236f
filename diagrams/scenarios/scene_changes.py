"""What a scenario changes about the plant before it is finalized: a joint, or one cube more."""

from pydrake.multibody.plant import MultibodyPlant

from diagrams.arm_controller import JOINTS
from diagrams.scenarios.schema import Scenario
from models.scenes.parsing import ARM, CUBE, DESCRIPTION, strict_parser

SECOND = "second_cube"
"""Model instance and body of the distractor."""


def change_scene(scenario: Scenario, plant: MultibodyPlant) -> None:
    """Change a plant that has the station's models, before it is finalized."""
    if scenario.weak_joint is not None:
        weak = scenario.weak_joint
        arm = plant.GetModelInstanceByName(ARM)
        actuator = plant.GetJointActuatorByName(JOINTS[weak.joint - 1], arm)
        actuator.set_effort_limit(weak.share * actuator.effort_limit())
    if scenario.distractor is not None:
        text = (DESCRIPTION / "cube.sdf").read_text(encoding="utf-8")
        for tag in ("model", "link"):
            text = text.replace(f'<{tag} name="{CUBE}">', f'<{tag} name="{SECOND}">')
        strict_parser(plant).AddModelsFromString(text, "sdf")
