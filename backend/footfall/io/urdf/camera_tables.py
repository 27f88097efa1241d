"""The stereo cameras of a robot.toml: where on the chassis they sit, and where they look."""

from collections.abc import Mapping, Sequence

import numpy as np

from footfall.core.errors import InvalidRobot
from footfall.core.frames import apply, rotation_rpy
from footfall.robot.camera_pairs import camera_pair, focal_length, looking_axes
from footfall.robot.description import CameraPairSpec
from footfall.robot.legged.find_legs import chain_to
from footfall.robot.legged.legged_model import LeggedModel, held_joints
from footfall.robot.table import Table
from footfall.telemetry.images import LONGEST_NAME

CAMERA = "name link position rpy width height fov_deg baseline"
MOST_PIXELS = 8192
"""Along each side of an image."""


def camera_pairs(
    tables: Sequence[Table], model: LeggedModel, postures: Mapping[str, Mapping[str, float]]
) -> tuple[CameraPairSpec, ...]:
    """The pairs; joints that are no leg's are held as everywhere. Raises InvalidRobot naming what can't be used."""
    moved = {joint: leg.name for leg in model.legs for joint in leg.joints}
    poses = model.tree.poses(held_joints(model, postures))
    pairs: list[CameraPairSpec] = []
    for table in tables:
        table.only(CAMERA)
        name, link = table.text("name"), table.text("link")
        where = f"camera pair {name}"
        if len(name) > LONGEST_NAME:
            raise InvalidRobot(f"{where} has a name of more than {LONGEST_NAME} characters")
        if any(pair.name == name for pair in pairs):
            raise InvalidRobot(f"two camera pairs are called {name}")
        if link not in poses:
            raise InvalidRobot(f"{where}: the URDF has no link {link!r}")
        leg = next((moved[one.name] for one in chain_to(model.tree, link) if one.name in moved), None)
        if leg is not None:
            raise InvalidRobot(f"{where} sits on {link}, which leg {leg} moves; it needs a link of the chassis")
        place = table.numbers("position", 3) if "position" in table else np.zeros(3)
        turn = table.numbers("rpy", 3) if "rpy" in table else np.zeros(3)
        R_base_camera = poses[link][:3, :3] @ rotation_rpy(*turn) @ looking_axes()
        width, height = (_size(table, side, where) for side in ("width", "height"))
        fov, baseline = table.number("fov_deg"), table.number("baseline")
        if not 0 < fov < 180:
            raise InvalidRobot(f"{where}: fov_deg must be above 0 and below 180", fov_deg=fov)
        if not baseline > 0:
            raise InvalidRobot(f"{where}: baseline must be above zero [m]", baseline=baseline)
        focal = focal_length(width, fov)
        pairs.append(camera_pair(name, R_base_camera, apply(poses[link], place), width, height, focal, baseline))
    return tuple(pairs)


def _size(table: Table, side: str, where: str) -> int:
    pixels = table.integer(side)
    if not 1 <= pixels <= MOST_PIXELS:
        raise InvalidRobot(f"{where}: {side} must be 1 to {MOST_PIXELS} pixels", **{side: pixels})
    return pixels
