"""Which legs FootFall can't walk with, and why."""

from footfall.robot.legged.followers import followed_by
from footfall.robot.legged.legged_model import LegChain
from footfall.robot.legged.tree import RobotTree

FEWEST_JOINTS, MOST_JOINTS = 3, 7
"""Of a leg that can walk: fewer can't place a foot everywhere; the torque program takes no more."""


def why_unable(tree: RobotTree, leg: LegChain) -> str:
    """Why a leg can't walk, in words; empty where it can.

    Args:
        tree: links and joints of its robot.
        leg: one of its legs.

    Returns:
        The first reason.
    """
    joints = [tree.joint(name) for name in leg.joints]
    for joint in joints:
        leader, ratio, _ = followed_by(tree, joint)
        if leader.name not in leg.joints:
            return f"{joint.name} follows {leader.name}, which is no joint of it"
        if ratio == 0:
            return f"{joint.name} follows {leader.name} by a multiplier of 0: a fixed joint would be right"
    free = sum(not joint.mimic for joint in joints)
    if free < min(FEWEST_JOINTS, len(joints)):
        return f"{free} of its {len(joints)} joints move by themselves, and one that walks needs {FEWEST_JOINTS}"
    if not FEWEST_JOINTS <= len(joints) <= MOST_JOINTS:
        return f"it has {len(joints)} joints, and one that walks needs {FEWEST_JOINTS} to {MOST_JOINTS}"
    if leg.sole.kind == "flat":
        return "it has a flat sole; robots that walk have balls, points or discs for feet"
    return ""
