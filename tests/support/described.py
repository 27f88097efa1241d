"""Robots that others described, read once for all tests: real ones by name, made ones by the number of legs."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from footfall.core.arrays import Array
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.touching import touching
from tests.support.robot_data import described
from tests.support.walkers import ring


@cache
def robot_of(name: str | int) -> tuple[Path, LeggedRobot]:
    """The URDF of a robot and the robot."""
    if isinstance(name, int):
        path = Path(mkdtemp()) / "robot.urdf"
        path.write_text(ring(name), encoding="utf-8")
    else:
        path = described(name)
    model = legged_model(read_urdf(path))
    return path, LeggedRobot(model, always=touching(model.tree, 40).always)


def sprung(robot: LeggedRobot, stiffness: float | Array) -> LeggedRobot:
    """The robot as if its robot.toml said how stiff its joints are [N·m/rad or N/m]: all alike, or each (joints,)."""
    model, *others = robot.__reduce__()[1]
    each = dict(zip(robot.joint_names, np.broadcast_to(stiffness, len(robot.joint_names)).tolist(), strict=True))
    tree = model.tree
    joints = tuple(replace(one, stiffness=each[one.name]) if one.name in each else one for one in tree.joints)
    return LeggedRobot(replace(model, tree=replace(tree, joints=joints)), *others)
