"""Made robots whose legs slide, as URDF text: four legs around a drum, balls for feet."""

import numpy as np

from tests.support.urdf import FOOT, link

GANTRY = (
    ("x", "prismatic", "0.05 0 0", "1 0 0", (0.0, 0.2)),
    ("y", "prismatic", "0.05 0 -0.05", "0 1 0", (-0.12, 0.12)),
    ("z", "prismatic", "0 0 -0.28", "0 0 -1", (0.0, 0.2)),
)
TELESCOPE = (
    ("yaw", "revolute", "0.08 0 0", "0 0 1", (-0.8, 0.8)),
    ("pitch", "revolute", "0.1 0 0", "0 1 0", (0.2, 1.57)),
    ("out", "prismatic", "0.25 0 0", "1 0 0", (0.0, 0.25)),
)
"""Joints of a leg from the drum outward: name, kind, place of what comes after it, axis, limits [rad, m]."""


def sliders(joints: tuple[tuple[str, str, str, str, tuple[float, float]], ...]) -> str:
    """A robot whose four legs have these joints."""
    parts = [link("base", 8.0, '<geometry><cylinder radius="0.15" length="0.08"/></geometry>')]
    for leg, angle in enumerate(np.pi * (np.arange(4) + 0.5) / 2):
        parent, rpy = "base", f"0 0 {angle:.6f}"
        xyz = f"{0.2 * np.cos(angle):.6f} {0.2 * np.sin(angle):.6f} 0"
        for name, kind, after, axis, (lower, upper) in joints:
            body = f"l{leg}_{name}_link"
            parts.append(link(body, 0.3, '<geometry><box size="0.03 0.03 0.03"/></geometry>'))
            parts.append(
                f'<joint name="l{leg}_{name}" type="{kind}"><parent link="{parent}"/><child link="{body}"/>'
                f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
                f'<limit lower="{lower}" upper="{upper}" effort="400" velocity="1"/></joint>'
            )
            parent, xyz, rpy = body, after, "0 0 0"
        parts += [
            link(f"l{leg}_foot", 0.05, FOOT),
            f'<joint name="l{leg}_sole" type="fixed"><parent link="{parent}"/><child link="l{leg}_foot"/>'
            f'<origin xyz="{xyz}"/></joint>',
        ]
    return "\n".join(['<robot name="sliders">', *parts, "</robot>"])
