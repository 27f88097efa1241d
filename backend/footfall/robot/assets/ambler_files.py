"""The Ambler's description, made of its sizes: its URDF, and the robot.toml beside it.

A foot's joints are at zero where it stands in the typical stance, with the extension half out. The boom slides through
its hub, and the inner tube in the outer one; the shafts that carry the hubs have no shape of their own, as the hubs are
around them. The foot is the lower end of the inner tube.
"""

import math
from collections.abc import Iterator

from footfall.robot.assets.ambler_sizes import AmblerSizes

STACKS = {"left": 1, "right": -1}
LEVELS = ("low", "mid", "high")
"""Legs of a stack from below; in the typical stance they stand in front, in the middle and in the rear."""
JOINTS = ("rotation", "extension", "vertical")


def ambler_urdf(sizes: AmblerSizes) -> str:
    """The URDF: only boxes and cylinders."""
    length, beyond, height = sizes.arch
    box = (length, sizes.apart + beyond, height)
    lines = ['<?xml version="1.0"?>', '<robot name="ambler">', _box("base", sizes.arch_mass, box, (0, 0, height / 2))]
    for stack, side in STACKS.items():
        for level, name in enumerate(LEVELS):
            lines += _leg(sizes, f"{stack}_{name}", side, level)
    return "\n".join([*lines, "</robot>"]) + "\n"


def ambler_toml(sizes: AmblerSizes) -> str:
    """The robot.toml: legs, the typical stance, clearances."""
    names = [(stack, level, f"{stack}_{name}") for stack in STACKS for level, name in enumerate(LEVELS)]
    mass = sizes.arch_mass + len(names) * sum(sizes.leg_masses)
    lines = [
        "# The Ambler, made by `python -m footfall.robot.assets.generate` of robot/assets/ambler_sizes.py,",
        "# which says of every size whether it is published or assumed.",
        'name = "ambler"',
        'urdf = "ambler.urdf"',
        "packages = []",
        'base = "base"',
        f"mass_check = {mass:g}  # [kg] (assumed) the sum of the links: nobody weighed it",
        "",
    ]
    for _, level, name in names:
        joints = ", ".join(f'"{name}_{joint}"' for joint in JOINTS)
        lines += ["[[legs]]", f'name = "{name}"', f'foot = "{name}_inner"', f"joints = [{joints}]", f"group = {level}"]
        lines += ['sole = "point"', "center = [0.0, 0.0, 0.0]", ""]
    lines.append("[postures.stand]  # 5 m tall, 4.5 m wide, 3.5 m long: Wettergreen, Thomas, Thorpe 1990")
    for _, level, name in names:
        angles = (0.0, sizes.extension(1 - level), 0.0)
        lines += [f"{name}_{joint} = {angle:.15g}" for joint, angle in zip(JOINTS, angles, strict=True)]
    lines += ["", "[clearances]  # least distances [m], (assumed)"]
    lines += [f"{name} = {sizes.clearance:g}" for name in ("other_leg", "own_leg", "base", "ground")]
    lines += ["", "[collisions]", "samples = 200", "seed = 0", "always = []", "never = []"]
    return "\n".join(lines) + "\n"


def _leg(sizes: AmblerSizes, name: str, side: int, level: int) -> Iterator[str]:
    boom_height = sizes.lowest + level * sizes.rise
    hub, boom, outer, inner = sizes.leg_masses
    half = (sizes.longest - sizes.shortest) / 2
    behind = 2 * half + sizes.overlap
    sheath = boom_height - sizes.sheath
    azimuth = side * (math.pi / 2 - sizes.azimuth(1 - level))
    yield _rod(f"{name}_hub", hub, *sizes.hub, 0.0)
    yield _box(f"{name}_boom", boom, (behind, *sizes.boom), (-behind / 2, 0, 0))
    yield _rod(f"{name}_outer", outer, sizes.outer, sheath, -sheath / 2)
    yield _rod(f"{name}_inner", inner, sizes.inner, sizes.tube, sizes.tube / 2)
    at = (0.0, side * sizes.apart / 2, boom_height - sizes.base_height)
    limits = ((0.0, 0.0), (-half, half), (-sizes.upward, sizes.downward))
    axes = ("0 0 1", "1 0 0", "0 0 -1")
    places = ((at, azimuth), ((sizes.middle, 0.0, 0.0), 0.0), ((0.0, 0.0, -boom_height), 0.0))
    links = ("base", f"{name}_hub", f"{name}_boom", f"{name}_inner")
    for k, joint in enumerate(JOINTS):
        kind = "continuous" if joint == "rotation" else "prismatic"
        ends = f' lower="{limits[k][0]:g}" upper="{limits[k][1]:g}"' if kind == "prismatic" else ""
        limit = f'<limit{ends} effort="{sizes.efforts[k]:g}" velocity="{sizes.speeds[k]:g}"/>'
        more = f'<axis xyz="{axes[k]}"/>{limit}'
        yield _joint(f"{name}_{joint}", kind, links[k], links[k + 1], *places[k], more)
    yield _joint(f"{name}_sheath", "fixed", f"{name}_boom", f"{name}_outer", (0.0, 0.0, 0.0), 0.0)


def _box(name: str, mass: float, size: tuple[float, float, float], center: tuple[float, float, float]) -> str:
    x, y, z = (mass * one**2 / 12 for one in size)
    return _link(name, mass, (y + z, x + z, x + y), center, f'<box size="{_numbers(*size)}"/>')


def _rod(name: str, mass: float, radius: float, length: float, height: float) -> str:
    """An upright cylinder with its middle at a height."""
    across = mass * (3 * radius**2 + length**2) / 12
    shape = f'<cylinder radius="{radius:g}" length="{length:.6g}"/>'
    return _link(name, mass, (across, across, mass * radius**2 / 2), (0.0, 0.0, height), shape)


def _link(
    name: str, mass: float, inertia: tuple[float, float, float], center: tuple[float, float, float], shape: str
) -> str:
    xx, yy, zz = (f"{one:.6g}" for one in inertia)
    origin = f'<origin xyz="{_numbers(*center)}"/>'
    moments = f'<inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>'
    inertial = f'<inertial>{origin}<mass value="{mass:g}"/>{moments}</inertial>'
    geometry = f"{origin}<geometry>{shape}</geometry>"
    return f'  <link name="{name}">{inertial}<collision>{geometry}</collision><visual>{geometry}</visual></link>'


def _joint(
    name: str, kind: str, parent: str, child: str, at: tuple[float, float, float], yaw: float, more: str = ""
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    origin = f'<origin xyz="{_numbers(*at)}" rpy="0 0 {yaw:.12g}"/>'
    return f'  <joint name="{name}" type="{kind}">{ends}{origin}{more}</joint>'


def _numbers(*values: float) -> str:
    return " ".join(f"{value + 0.0:.6g}" for value in values)
