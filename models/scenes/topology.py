"""What moves with which joint of the arm, as the plant has it joined together.

A tool, camera or bracket may be a model of its own, welded to the hand or to any link; what it is
called and which model it belongs to does not matter. Nor does which end of a joint is the parent.
"""

from collections import defaultdict, deque

from pydrake.multibody.tree import BodyIndex, Joint, JointIndex, WeldJoint

from models.errors import ModelError
from models.scenes.planning_scene import PlanningScene


def links_of_bodies(scene: PlanningScene) -> dict[BodyIndex, int]:
    """How many of the arm's joints are between the world and each body that has collision shapes.

    0 stands still while the arm moves, whatever else may move it: the base, furniture, the cube.
    n, the number of the arm's joints, is the last link with the hand and all that these carry;
    where the fingers stand makes no difference.

    Raises:
        ModelError: if a body is moved by the arm and by a joint of something else, or by the
            arm's joints in another order.
    """
    plant = scene.plant
    arm, fingers = (
        [plant.GetJointByName(name, instance).index() for name in names]
        for names, instance in (
            (scene.robot.joints, scene.arm_instance),
            (scene.robot.finger_joints, scene.hand_instance),
        )
    )
    links = {}
    for index, chain in _chains(scene).items():
        body = plant.get_body(index)
        moved = [joint for joint in chain if joint in arm]
        if not plant.GetCollisionGeometriesForBody(body):
            continue
        others = [joint for joint in chain[len(moved) :] if joint not in fingers]
        if moved and (chain[: len(moved)] != arm[: len(moved)] or others):
            strange = [joint for joint in chain if joint not in arm and joint not in fingers]
            names = ", ".join(plant.get_joint(joint).name() for joint in strange or chain)
            raise ModelError(
                f"{body.scoped_name().get_full()}: the arm moves it, and so does {names}, which "
                "no proof covers; valid: bodies welded to a link or to the hand"
            )
        links[index] = len(moved)
    return links


def _chains(scene: PlanningScene) -> dict[BodyIndex, list[JointIndex]]:
    """Joints that can move, from the world outwards to each body.

    Raises:
        ModelError: if joints form a loop.
    """
    plant = scene.plant
    joints: dict[BodyIndex, list[tuple[Joint, BodyIndex]]] = defaultdict(list)
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        parent, child = joint.parent_body().index(), joint.child_body().index()
        joints[parent].append((joint, child))
        joints[child].append((joint, parent))
    world = plant.world_body().index()
    chains: dict[BodyIndex, list[JointIndex]] = {world: []}
    used = set()
    queue = deque([world])
    while queue:
        body = queue.popleft()
        for joint, other in joints[body]:
            if joint.index() in used:
                continue
            used.add(joint.index())
            if other in chains:
                raise ModelError(f"joint {joint.name()} closes a loop; valid: trees of bodies")
            moving = [] if isinstance(joint, WeldJoint) else [joint.index()]
            chains[other] = chains[body] + moving
            queue.append(other)
    return chains
