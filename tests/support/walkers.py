"""Made robots that walk, as URDF text: legs in a ring, each with a yaw and two pitches, balls for feet."""

import numpy as np

from tests.support.urdf import FOOT

COXA, THIGH, SHANK = 0.08, 0.22, 0.26
RADIUS, MASS = 0.2, 8.0


def ring(legs: int, effort: float = 60.0) -> str:
    """A robot with its legs evenly around a drum of 0.2 m, the first straight ahead where their number is odd."""
    drum = '<geometry><cylinder radius="0.15" length="0.08"/></geometry>'
    parts = [_link("base", MASS, drum, "0 0 0")]
    for leg in range(legs):
        angle = 2 * np.pi * (leg + 0.5 * (legs % 2 == 0)) / legs
        parts += _leg(f"l{leg}", angle, effort)
    return "\n".join(['<robot name="ring">', *parts, "</robot>"])


def _leg(name: str, angle: float, effort: float) -> list[str]:
    hip = f"{RADIUS * np.cos(angle):.6f} {RADIUS * np.sin(angle):.6f} 0"
    return [
        _link(f"{name}_coxa", 0.3, _rod(COXA), f"{COXA / 2} 0 0"),
        _link(f"{name}_thigh", 0.5, _rod(THIGH), f"{THIGH / 2} 0 0"),
        _link(f"{name}_shank", 0.3, _rod(SHANK), f"{SHANK / 2} 0 0"),
        _link(f"{name}_foot", 0.05, FOOT.replace("0.03", "0.02"), "0 0 0"),
        _joint(f"{name}_yaw", "base", f"{name}_coxa", hip, f"0 0 {angle:.6f}", "0 0 1", (-0.9, 0.9), effort),
        _joint(f"{name}_hip", f"{name}_coxa", f"{name}_thigh", f"{COXA} 0 0", "0 0 0", "0 1 0", (-1.4, 1.0), effort),
        _joint(f"{name}_knee", f"{name}_thigh", f"{name}_shank", f"{THIGH} 0 0", "0 0 0", "0 1 0", (0.3, 2.6), effort),
        f'<joint name="{name}_sole" type="fixed"><parent link="{name}_shank"/><child link="{name}_foot"/>'
        f'<origin xyz="{SHANK} 0 0"/></joint>',
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
