"""A four-legged robot as URDF text, to break on purpose."""

from collections.abc import Callable
from pathlib import Path

LEGS = {"LF": (0.3, 0.2), "RF": (0.3, -0.2), "LH": (-0.3, 0.2), "RH": (-0.3, -0.2)}
INERTIA = '<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>'
LIMIT = '<limit lower="-1" upper="1" effort="40" velocity="8"/>'
FOOT = '<geometry><sphere radius="0.03"/></geometry>'


def link(name: str, mass: float, geometry: str) -> str:
    inertial = f'<inertial><mass value="{mass}"/>{INERTIA}</inertial>'
    return f'<link name="{name}">{inertial}<collision>{geometry}</collision></link>'


def joint(name: str, parent: str, child: str, xyz: str, kind: str = "revolute") -> str:
    limit = "" if kind == "fixed" else f'<axis xyz="0 1 0"/>{LIMIT}'
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<origin xyz="{xyz}"/>{limit}</joint>'


def leg(name: str, x: float, y: float) -> str:
    rod = '<origin xyz="0 0 -0.15"/><geometry><cylinder radius="0.02" length="0.2"/></geometry>'
    parts = [
        link(f"{name}_thigh", 2.0, rod),
        link(f"{name}_shank", 1.0, rod),
        link(f"{name}_foot", 0.1, FOOT),
        joint(f"{name}_hip", "base", f"{name}_thigh", f"{x} {y} 0"),
        joint(f"{name}_knee", f"{name}_thigh", f"{name}_shank", "0 0 -0.3"),
        joint(f"{name}_sole", f"{name}_shank", f"{name}_foot", "0 0 -0.3", "fixed"),
    ]
    return "\n".join(parts)


def quadruped(change: Callable[[str], str] = lambda text: text) -> str:
    """A sound robot: a base of 10 kg and four legs of two joints, 0.6 m long; then changed."""
    base = link("base", 10.0, '<geometry><box size="0.7 0.3 0.1"/></geometry>')
    text = "\n".join(['<robot name="table">', base, *(leg(name, *place) for name, place in LEGS.items()), "</robot>"])
    return change(text)


def replaced(old: str, new: str, count: int = 1) -> Callable[[str], str]:
    """A change: the first ``count`` of ``old`` become ``new``; there must be one."""

    def change(text: str) -> str:
        if old not in text:
            raise ValueError(f"{old!r} does not stand in the URDF")
        return text.replace(old, new, count)

    return change


def written(folder: Path, text: str) -> Path:
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return path
