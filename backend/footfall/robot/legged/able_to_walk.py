"""Which legs FootFall can't walk with, and why."""

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
    mimics = next((name for name in leg.joints if tree.joint(name).mimic), None)
    if mimics is not None:
        return f"{mimics} follows another joint, and legs that walk need free ones"
    if not FEWEST_JOINTS <= len(leg.joints) <= MOST_JOINTS:
        return f"it has {len(leg.joints)} joints, and one that walks needs {FEWEST_JOINTS} to {MOST_JOINTS}"
    if leg.sole.kind == "flat":
        return "it has a flat sole; robots that walk have balls, points or discs for feet"
    return ""
