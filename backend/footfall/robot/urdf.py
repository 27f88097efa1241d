"""The URDF text of a described robot: deterministic, so that the committed file can be compared."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.mesh import Mesh
from footfall.robot.description import JOINTS, joint_name, link_name
from footfall.robot.meshes.shapes import extents
from footfall.robot.table import Table

_AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def urdf_text(name: str, table: Table, mounts: Sequence[NDArray[np.float64]], parts: Mapping[str, Mesh]) -> str:
    """URDF with links and joints named as description.py says.

    Angles to 12 digits; meshes by relative path.

    Args:
        name: of the robot.
        table: the description file.
        mounts: T_base_hip of each leg, (4, 4).
        parts: part → its mesh [m].

    Returns:
        The text.
    """
    lines = ['<?xml version="1.0"?>', f'<robot name="{name}">']
    chassis = table.table("chassis")
    lines += _link("base", "base", parts, chassis.number("mass"), chassis.numbers("center_of_mass", 3))
    joints = table.tables("joints")
    for leg, T_base_hip in enumerate(mounts):
        parent = "base"
        for joint, (part, axis) in zip(joints, JOINTS, strict=True):
            mass, center = joint.number("mass"), joint.numbers("center_of_mass", 3)
            lines += _link(link_name(leg, part), part, parts, mass, center)
            origin, yaw = joint.numbers("offset", 3), 0.0
            if part == "hip_yaw":
                origin, yaw = T_base_hip[:3, 3], math.atan2(T_base_hip[1, 0], T_base_hip[0, 0])
            lower, upper = np.deg2rad(joint.numbers("limits_deg", 2))
            effort, velocity = joint.number("torque_limit"), joint.number("speed_limit")
            lines += [
                f'  <joint name="{joint_name(leg, part)}" type="revolute">',
                f'    <parent link="{parent}"/>',
                f'    <child link="{link_name(leg, part)}"/>',
                f'    <origin xyz="{_text(origin)}" rpy="0 0 {_text([yaw])}"/>',
                f'    <axis xyz="{_AXES[axis]}"/>',
                f'    <limit lower="{_text([lower])}" upper="{_text([upper])}"'
                f' effort="{_text([effort])}" velocity="{_text([velocity])}"/>',
                "  </joint>",
            ]
            parent = link_name(leg, part)
        lines += _link(link_name(leg, "wheel"), "wheel", parts)
        lines += [
            f'  <joint name="{joint_name(leg, "wheel")}" type="fixed">',
            f'    <parent link="{parent}"/>',
            f'    <child link="{link_name(leg, "wheel")}"/>',
            f'    <origin xyz="{_text(table.table("wheel").numbers("offset", 3))}" rpy="0 0 0"/>',
            "  </joint>",
        ]
    return "\n".join([*lines, "</robot>"]) + "\n"


def _link(
    name: str, part: str, parts: Mapping[str, Mesh], mass: float = 0.0, center: ArrayLike = (0.0, 0.0, 0.0)
) -> list[str]:
    lines = [f'  <link name="{name}">']
    if mass:
        x, y, z = extents(parts[part]) ** 2
        ixx, iyy, izz = mass / 12 * np.array([y + z, z + x, x + y])
        lines += [
            "    <inertial>",
            f'      <origin xyz="{_text(center)}" rpy="0 0 0"/>',
            f'      <mass value="{_text([mass])}"/>',
            f'      <inertia ixx="{_text([ixx])}" ixy="0" ixz="0" iyy="{_text([iyy])}" iyz="0" izz="{_text([izz])}"/>',
            "    </inertial>",
        ]
    for use in ("visual", "collision"):
        lines.append(f'    <{use}><geometry><mesh filename="meshes/{part}.obj"/></geometry></{use}>')
    return [*lines, "  </link>"]


def _text(numbers: ArrayLike) -> str:
    return " ".join(f"{n + 0.0:.12g}" for n in np.asarray(numbers, float))
