"""Joints of legs that follow others, and the limits that all of them leave each other."""

from collections.abc import Sequence

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.robot.legged.tree import RobotTree, TreeJoint
from footfall.robot.limb.coupling import Coupling


def followed_by(tree: RobotTree, joint: TreeJoint) -> tuple[TreeJoint, float, float]:
    """Which joint moves another in the end, also by way of others.

    Args:
        tree: links and joints of the robot.
        joint: one of them.

    Returns:
        That joint, itself where it moves by itself, and ratio and offset of its angle to that one's [rad or m].
    """
    ratio, offset = 1.0, 0.0
    while joint.mimic:
        offset += ratio * joint.offset
        ratio *= joint.multiplier
        joint = tree.joint(joint.mimic)
    return joint, ratio, offset


def coupling_of(tree: RobotTree, joints: Sequence[TreeJoint]) -> Coupling:
    """Which of the joints of legs that can walk follow others of them."""
    number = {joint.name: at for at, joint in enumerate(joints)}
    follows = [followed_by(tree, joint) for joint in joints]
    leads = np.array([number[leader.name] for leader, _, _ in follows], np.int64)
    return Coupling(leads, np.array([one[1] for one in follows]), np.array([one[2] for one in follows]))


def limits_of(joints: Sequence[TreeJoint], coupling: Coupling) -> Array:
    """Lower and upper limits: a joint that others follow goes no farther than they may.

    Args:
        joints: of legs.
        coupling: which of them follow others.

    Returns:
        (joints, 2) [rad or m]; those that turn go at most half a turn to each side of the middle posture.

    Raises:
        InvalidRobot: limits are missing or no interval, or nowhere do a joint and its followers all keep theirs.
    """
    free = coupling.free
    limits = np.array(
        [_own(joint) if by_itself else _said(joint) for joint, by_itself in zip(joints, free, strict=True)]
    )
    for at in np.flatnonzero(~free).tolist():
        lead, ratio, offset = int(coupling.leads[at]), coupling.ratios[at], coupling.offsets[at]
        low, high = sorted((limits[at] - offset) / ratio)
        limits[lead] = max(limits[lead, 0], low), min(limits[lead, 1], high)
        if not limits[lead, 0] < limits[lead, 1]:
            raise InvalidRobot(
                f"joint {joints[at].name} follows {joints[lead].name}, and at no place do both keep their limits"
            )
    for at in np.flatnonzero(~free):
        limits[at] = sorted(coupling.ratios[at] * limits[coupling.leads[at]] + coupling.offsets[at])
    return limits


def _said(joint: TreeJoint) -> tuple[float, float]:
    """Limits of a follower, none where the description says no interval: its leader's are enough."""
    said = joint.kind != "continuous" and np.isfinite([joint.lower, joint.upper]).all() and joint.lower < joint.upper
    return (joint.lower, joint.upper) if said else (-np.inf, np.inf)


def _own(joint: TreeJoint) -> tuple[float, float]:
    """Lower and upper limit, at most half a turn to each side of the middle posture.

    Raises InvalidRobot where they are no interval.
    """
    if joint.kind == "continuous":
        return -np.pi, np.pi
    if not (np.isfinite([joint.lower, joint.upper]).all() and joint.lower < joint.upper):
        raise InvalidRobot(
            f"joint {joint.name} has no limits, lower below upper; walking needs them: "
            f'say them in the robot.toml, under [joints."{joint.name}"]'
        )
    if joint.kind == "prismatic":
        return joint.lower, joint.upper
    return max(joint.lower, joint.neutral - np.pi), min(joint.upper, joint.neutral + np.pi)
