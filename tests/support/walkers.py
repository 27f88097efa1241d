"""Made robots that walk, as URDF text: legs in a ring, each with a yaw and two pitches or more, balls for feet."""

import numpy as np

from tests.support.urdf import FOOT

COXA, THIGH, SHANK = 0.08, 0.22, 0.26
RADIUS, MASS = 0.2, 8.0
MORE = ("thigh_roll", "shank_roll", "ankle", "toe")
"""Joints of legs that have more than three, in this order; links of thigh and shank are cut by them in equal parts."""
JOINTS = {
    "yaw": ("0 0 1", (-0.9, 0.9)),
    "hip": ("0 1 0", (-1.4, 1.0)),
    "thigh_roll": ("1 0 0", (-0.7, 0.7)),
    "knee": ("0 1 0", (0.3, 2.6)),
    "shank_roll": ("1 0 0", (-0.7, 0.7)),
    "ankle": ("0 1 0", (-0.7, 0.7)),
    "toe": ("1 0 0", (-0.7, 0.7)),
}
"""Axis and limits [rad] of each joint."""


def ring(legs: int, effort: float = 60.0, joints: int = 3) -> str:
    """A robot with its legs evenly around a drum of 0.2 m, the first straight ahead where their number is odd.

    joints: of each leg, 3 to 7; those beyond three are of MORE.
    """
    drum = '<geometry><cylinder radius="0.15" length="0.08"/></geometry>'
    parts = [_link("base", MASS, drum, "0 0 0")]
    for leg in range(legs):
        angle = 2 * np.pi * (leg + 0.5 * (legs % 2 == 0)) / legs
        parts += _leg(f"l{leg}", angle, effort, MORE[: joints - 3])
    return "\n".join(['<robot name="ring">', *parts, "</robot>"])


def _leg(name: str, angle: float, effort: float, more: tuple[str, ...]) -> list[str]:
    """Joints from the drum outward, each with the link that it moves: its length and mass."""
    thigh = ("thigh_roll",) if "thigh_roll" in more else ()
    shank = [one for one in more if one not in thigh]
    links = [("yaw", "coxa", COXA, 0.3), ("hip", "thigh", THIGH / (1 + len(thigh)), 0.5)]
    links += [(one, one, THIGH / 2, 0.2) for one in thigh]
    part = SHANK / (1 + len(shank))
    links += [("knee", "shank", part, 0.3)] + [(one, one, part, 0.1) for one in shank]
    bodies, between, parent, rpy = [], [], "base", f"0 0 {angle:.6f}"
    xyz = f"{RADIUS * np.cos(angle):.6f} {RADIUS * np.sin(angle):.6f} 0"
    for joint, moved, length, mass in links:
        link, (axis, limits) = f"{name}_{moved}", JOINTS[joint]
        bodies.append(_link(link, mass, _rod(length), f"{length / 2} 0 0"))
        between.append(_joint(f"{name}_{joint}", parent, link, xyz, rpy, axis, limits, effort))
        parent, xyz, rpy = link, f"{length} 0 0", "0 0 0"
    return [
        *bodies,
        _link(f"{name}_foot", 0.05, FOOT.replace("0.03", "0.02"), "0 0 0"),
        *between,
        f'<joint name="{name}_sole" type="fixed"><parent link="{parent}"/><child link="{name}_foot"/>'
        f'<origin xyz="{xyz}"/></joint>',
    ]


def _rod(length: float) -> str:
    return f'<geometry><box size="{0.7 * length:.4f} 0.03 0.03"/></geometry>'


def _link(name: str, mass: float, geometry: str, center: str) -> str:
    inertia = '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>'
    inertial = f'<inertial><origin xyz="{center}"/><mass value="{mass}"/>{inertia}</inertial>'
    return f'<link name="{name}">{inertial}<collision><origin xyz="{center}"/>{geometry}</collision></link>'


def _joint(
    name: str, parent: str, child: str, xyz: str, rpy: str, axis: str, limits: tuple[float, float], effort: float
) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="{effort}" velocity="6"/></joint>'
    )
