"""From the table of a description file to a RobotDescription; refuses what FootFall can't solve, by name."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidRobot
from footfall.core.frames import rotation, transform
from footfall.core.mesh import Mesh
from footfall.robot.camera_pairs import camera_pair, focal_length, looking_axes
from footfall.robot.description import (
    JOINTS,
    PARTS,
    CameraPairSpec,
    Clearances,
    Leg,
    PartPair,
    Payload,
    RobotDescription,
    joint_name,
    link_name,
)
from footfall.robot.meshes import shapes
from footfall.robot.table import Table
from footfall.robot.urdf import urdf_text

FORMAT = 1
LEG_COUNTS = range(3, 10)


def describe(raw: Mapping[str, Any]) -> RobotDescription:
    """Build the description from a parsed file (see assets/athlete/athlete.toml, which explains the format).

    Raises InvalidRobot naming the entry that is missing, of the wrong type, or of a leg structure that the
    closed-form inverse kinematics does not solve.
    """
    table = Table(raw, "")
    table.only("format name assumed chassis legs joints wheel postures_deg clearance cameras payload")
    if table.integer("format") != FORMAT:
        raise InvalidRobot(f"this FootFall reads robot descriptions of format {FORMAT}", format=table.integer("format"))
    name = table.text("name")
    _require_structure(name, table)
    joints = table.tables("joints")
    for joint in joints:
        joint.only("name axis offset limits_deg torque_limit speed_limit stiffness mass center_of_mass shape")
    wheel = table.table("wheel")
    wheel.only("axle offset radius width sides stiffness")
    mounts = _mounts(name, table.table("legs"))
    count = len(mounts)

    def per_joint(key: str) -> NDArray[np.float64]:
        return np.tile([joint.number(key) for joint in joints], count)

    limits = np.deg2rad([joint.numbers("limits_deg", 2) for joint in joints])
    legs = tuple(
        Leg(
            T_base_hip=T_base_hip,
            hip_offset=joints[1].numbers("offset", 3),
            thigh=float(joints[2].numbers("offset", 3)[0]),
            shank=float(joints[4].numbers("offset", 3)[0]),
            foot=float(wheel.numbers("offset", 3)[0]),
            link_names=tuple(link_name(i, part) for part in PARTS),
        )
        for i, T_base_hip in enumerate(mounts)
    )
    parts = part_meshes(raw)
    meshes = {"base": parts["base"]} | {link_name(i, part): parts[part] for i in range(count) for part in PARTS}
    postures = table.table("postures_deg")
    return RobotDescription(
        name=name,
        urdf=urdf_text(name, table, mounts, parts),
        meshes=meshes,
        legs=legs,
        joint_names=tuple(joint_name(i, part) for i in range(count) for part, _ in JOINTS),
        lower=np.tile(limits[:, 0], count),
        upper=np.tile(limits[:, 1], count),
        torque_limits=per_joint("torque_limit"),
        speed_limits=per_joint("speed_limit"),
        stiffness=per_joint("stiffness"),
        wheel_radius=wheel.number("radius"),
        wheel_width=wheel.number("width"),
        wheel_stiffness=wheel.number("stiffness"),
        wheel_sides=wheel.integer("sides"),
        postures={key: np.tile(np.deg2rad(postures.numbers(key, 6)), count) for key in postures},
        cameras=tuple(pair for group in table.tables("cameras") for pair in _camera_pairs(group)),
        clearances=_clearances(table.table("clearance")),
        payload=_payload(table.table("payload")),
        assumed=table.texts("assumed"),
    )


def part_meshes(raw: Mapping[str, Any]) -> dict[str, Mesh]:
    """Meshes of the chassis ("base") and of one leg's parts, each in its link's frame."""
    table = Table(raw, "")
    meshes = {"base": _shape(table.table("chassis").table("shape"))}
    for joint in table.tables("joints"):
        meshes[joint.text("name")] = _shape(joint.table("shape"))
    wheel = table.table("wheel")
    meshes["wheel"] = shapes.cylinder_y(wheel.number("radius"), wheel.number("width"), wheel.integer("sides"))
    return meshes


def _require_structure(name: str, table: Table) -> None:
    """Refuse by name every leg that is not z-y-y-x-y-x with a spherical ankle and a wheel."""
    _require_axes(name, table)
    if "wheel" not in table:
        raise InvalidRobot(f"{name} has no wheel; FootFall walks on wheels at the ends of the legs")
    wheel = table.table("wheel")
    _require_wheel(name, wheel)
    _require_offsets(name, table)
    if wheel.numbers("offset", 3)[1:].any():
        raise InvalidRobot(f"{name}: the wheel's offset must lie along x")


def _require_axes(name: str, table: Table) -> None:
    found = [(joint.text("name"), joint.text("axis")) for joint in table.tables("joints")]
    wanted = ", ".join(f"{part} ({axis})" for part, axis in JOINTS)
    if len(found) != len(JOINTS):
        raise InvalidRobot(f"{name} has {len(found)} joints a leg; FootFall solves legs of six: {wanted}", found=found)
    for (part, axis), (want_part, want_axis) in zip(found, JOINTS, strict=True):
        if part != want_part:
            raise InvalidRobot(f"{name} has joint {part!r} where {want_part!r} belongs; the order is {wanted}")
        if axis != want_axis:
            raise InvalidRobot(f"{name}: {part} turns about {axis}; FootFall solves legs where it is {want_axis}")


def _require_wheel(name: str, wheel: Table) -> None:
    if wheel.text("axle") != "y":
        raise InvalidRobot(f"{name}: the wheel's axle is {wheel.text('axle')}; it must be y of the ankle roll frame")
    for key in ("radius", "width", "stiffness"):
        if not wheel.number(key) > 0:
            raise InvalidRobot(f"{name}: the wheel's {key} must be above zero")
    if not 8 <= wheel.integer("sides") <= 128:
        raise InvalidRobot(f"{name}: the wheel's mesh needs 8 to 128 sides")


def _require_offsets(name: str, table: Table) -> None:
    for joint in table.tables("joints"):
        offset, part = joint.numbers("offset", 3), joint.text("name")
        if part in ("hip_yaw", "knee_roll", "ankle_roll") and offset.any():
            raise InvalidRobot(f"{name}: the offset of {part} must be zero: its axis meets the one before it")
        if part in ("knee_pitch", "ankle_pitch") and offset[1:].any():
            raise InvalidRobot(f"{name}: the offset of {part} must lie along x")


def _mounts(name: str, legs: Table) -> list[NDArray[np.float64]]:
    azimuths = legs.numbers("azimuths_deg")
    if len(azimuths) not in LEG_COUNTS:
        raise InvalidRobot(f"{name} has {len(azimuths)} legs; FootFall takes {LEG_COUNTS[0]} to {LEG_COUNTS[-1]}")
    return [_polar(azimuth, legs.number("mount_radius"), legs.number("mount_height")) for azimuth in azimuths]


def _polar(azimuth_deg: float, radius: float, height: float) -> NDArray[np.float64]:
    """T_base_x of a frame at that azimuth, x radially out. Rounded: the digest must not depend on the machine."""
    angle = math.radians(azimuth_deg)
    R = rotation("z", angle)
    return np.round(transform(R, R @ (radius, 0.0, height)), 12) + 0.0


def _shape(table: Table) -> Mesh:
    kind = table.text("kind")
    center = table.numbers("center", 3)
    if kind == "box":
        return shapes.box(table.numbers("size", 3), center)
    if kind == "prism":
        return shapes.prism(table.integer("corners"), table.number("width"), table.number("height"), center)
    raise InvalidRobot(f"{table.where}: a shape is a box or a prism", kind=kind)


def _camera_pairs(group: Table) -> list[CameraPairSpec]:
    group.only("name azimuths_deg radius height looking tilt_deg width height_px fov_deg baseline")
    width, height, baseline = group.integer("width"), group.integer("height_px"), group.number("baseline")
    looking = group.text("looking")
    if looking not in ("in", "out"):
        raise InvalidRobot(f"{group.where}: cameras look 'in' or 'out'", looking=looking)
    focal = focal_length(width, group.number("fov_deg"))
    R_look_camera = looking_axes(math.radians(group.number("tilt_deg")))
    pairs = []
    for number, azimuth in enumerate(group.numbers("azimuths_deg")):
        T_base_place = _polar(azimuth, group.number("radius"), group.number("height"))
        R_base_look = T_base_place[:3, :3] @ rotation("z", math.pi if looking == "in" else 0.0)
        R_base_camera, middle = R_base_look @ R_look_camera, T_base_place[:3, 3]
        name = f"{group.text('name')}{number}"
        pairs.append(camera_pair(name, R_base_camera, middle, width, height, focal, baseline))
    return pairs


def _clearances(table: Table) -> Clearances:
    table.only("chassis terrain own_leg payload other_leg chassis_terrain wheel_sink")

    def by_part(key: str) -> dict[str, float]:
        entries = table.table(key)
        for part in entries:
            _require_part(part, entries.where)
        return {part: entries.number(part) for part in entries}

    own_leg = []
    for entry in table.tables("own_leg"):
        pair = entry.texts("pair")
        if len(pair) != 2:
            raise InvalidRobot(f"{entry.where}: a pair names two parts")
        first, second = (_require_part(part, entry.where) for part in pair)
        own_leg.append(PartPair(first, second, entry.number("distance")))
    return Clearances(
        chassis=by_part("chassis"),
        terrain=by_part("terrain"),
        own_leg=tuple(own_leg),
        payload=table.number("payload"),
        other_leg=table.number("other_leg"),
        chassis_terrain=table.number("chassis_terrain"),
        wheel_sink=table.number("wheel_sink"),
    )


def _require_part(part: str, where: str) -> str:
    if part not in PARTS:
        raise InvalidRobot(f"{where}: {part!r} is no part of a leg; the parts are {', '.join(PARTS)}")
    return part


def _payload(table: Table) -> Payload | None:
    if table.number("mass") == 0:
        return None
    return Payload(table.number("mass"), table.numbers("size", 3), table.numbers("position", 3))
