"""Robots that others described, read once for all tests: real ones by name, made ones by the number of legs, or by that
and the number of joints of each."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from footfall.core.arrays import Array
from footfall.io.urdf.camera_tables import camera_pairs
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.touching import touching
from footfall.robot.table import Table
from tests.support.robot_data import described
from tests.support.walkers import ring


@cache
def robot_of(name: str | int | tuple[int, int]) -> tuple[Path, LeggedRobot]:
    """The URDF of a robot and the robot."""
    if isinstance(name, str):
        path = described(name)
    else:
        legs, joints = (name, 3) if isinstance(name, int) else name
        path = Path(mkdtemp()) / "robot.urdf"
        path.write_text(ring(legs, joints=joints), encoding="utf-8")
    model = legged_model(read_urdf(path))
    return path, LeggedRobot(model, always=touching(model.tree, 40).always)


def sprung(robot: LeggedRobot, stiffness: float | Array) -> LeggedRobot:
    """The robot as if its robot.toml said how stiff its joints are [N·m/rad or N/m]: all alike, or each (joints,)."""
    model, *others = robot.__reduce__()[1]
    each = dict(zip(robot.joint_names, np.broadcast_to(stiffness, len(robot.joint_names)).tolist(), strict=True))
    tree = model.tree
    joints = tuple(replace(one, stiffness=each[one.name]) if one.name in each else one for one in tree.joints)
    return LeggedRobot(replace(model, tree=replace(tree, joints=joints)), *others)


def seeing(robot: LeggedRobot, side: int = 240) -> LeggedRobot:
    """The made robot of six legs as if its robot.toml gave it cameras: one pair between every two legs, and one below.

    side: height of the images [px].
    """
    ways = [
        (f"out{k}", (0.17 * np.cos(a), 0.17 * np.sin(a), 0.03), 0.8, a) for k, a in enumerate(np.arange(6) * np.pi / 3)
    ]
    ways.append(("belly", (0.0, 0.0, -0.05), np.pi / 2, 0.0))
    size = {"width": side * 4 // 3, "height": side, "fov_deg": 110.0, "baseline": 0.06}
    tables = [
        Table({"name": name, "link": robot.model.base, "position": [*place], "rpy": [0.0, tilt, turn], **size}, name)
        for name, place, tilt, turn in ways
    ]
    about = robot.description
    pairs = camera_pairs(tables, about.model, about.postures)
    return LeggedRobot(about.model, about.postures, about.clearances, about.always, pairs)
