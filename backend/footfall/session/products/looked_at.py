"""Which ground a product looked at: what may be otherwise beside it without making it out of date.

Everything is bounded from outside: what a leg could touch, not what it touches.
"""

from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt

from footfall.core.arrays import Array
from footfall.core.grid import GridGeometry
from footfall.maps.layers import MapSettings, MapStack
from footfall.planning.scene.ground import touch_radius
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.session.products.kinds import Kind, LooksAt
from footfall.session.products.up_to_date import OtherGround
from footfall.telemetry.state import RobotState
from footfall.terrain.ground.changed import GroundChange, Mask

REMEMBERED = ("age", "height_sd")
"""Layers that tell of the looking, not of the ground: newer ground has others."""

STEP = 0.1
"""Lengths that a leg has left beyond a changed cell are rounded up to this [m]."""


def discs_of(kind: Kind, robot: Robot, made_for: RobotState, value: Any) -> Array | None:
    """The ground that a product looked at, (n, 3) discs of x, y and radius, site [m]; None: all of the map.

    What was not found is an answer of the whole map: ground that opens elsewhere may lead to another.
    """
    if kind.looks_at is LooksAt.LEG:
        return _of_leg(robot, made_for, value)
    if kind.looks_at is LooksAt.WAY:
        return _of_way(robot, value)
    return None


def _of_leg(robot: Robot, made_for: RobotState, value: Any) -> Array | None:
    """Where the leg could touch the ground, and under every wheel."""
    leg = value.leg if isinstance(value, MapStack) else None if value.plan is None else value.plan.leg
    if leg is None:
        return None
    settings = value.provenance.settings
    beside = settings.window if isinstance(settings, MapSettings) else 0.0
    hip = _hip(robot, made_for, leg)
    return np.vstack([(hip[0], hip[1], _stretched(robot, leg) + beside), *_under_wheels(robot, made_for, beside)])


def _of_way(robot: Robot, value: Any) -> Array | None:
    """Where any leg could touch the ground on the chassis' way."""
    plan = getattr(value, "execution", None) or getattr(value, "plan", None)
    if plan is None:
        return None
    places = plan.points if hasattr(plan, "points") else plan.Ts_site_base[:, :2, 3]
    places = np.asarray(places, float)
    gaps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    # between two places the chassis is at most half their distance from one of them
    half = 0.5 * float(gaps.max(initial=0.0))
    return np.column_stack([places, np.full(len(places), touch_radius(robot) + half)])


def other_ground(change: GroundChange, looked: Mask, everywhere: bool = True) -> OtherGround:
    """How much of the ground is otherwise at the cells ``looked`` at, (rows, cols), of those that changed."""
    cell = change.geometry.resolution**2
    both = looked & ~change.flipped
    return OtherGround(
        area=float(looked.sum()) * cell,
        turned=float((looked & change.flipped).sum()) * cell,
        by=float(change.by[both].max(initial=0.0)),
        everywhere=everywhere,
    )


def spoiled(robot: Robot, made_for: RobotState, maps: MapStack, change: GroundChange) -> Mask:
    """Cells of the maps, (rows, cols), whose values the change of the ground may have made wrong.

    A leg of length L from its hip h to a wheel at p can touch the ground at c only where ‖h − c‖ + ‖c − p‖ ≤ L. What
    changed under a wheel, or where the leg could touch it as it stands, is for all cells: on it balance and lifting
    rest.
    """
    grid, settings = maps.geometry, maps.provenance.settings
    window, raised = (settings.window, settings.raise_terrain) if isinstance(settings, MapSettings) else (1.0, 1.0)
    everywhere = np.ones(grid.shape, bool)
    if change.within(_under_wheels(robot, made_for, window)).any():
        return everywhere
    hip, length = _hip(robot, made_for, maps.leg), _stretched(robot, maps.leg)
    fine = change.geometry
    above = np.maximum(0.0, hip[2] - change.height - raised)
    to_hip = np.hypot(np.hypot(fine.xs - hip[0], (fine.ys - hip[1])[:, None]), above)
    # in ground layers a cell says what the window about it, and the wheel beside, is like
    about = np.maximum(length - to_hip, window + robot.wheel_radius) + np.sqrt(2.0) * fine.resolution
    about[~change.cells] = 0.0
    within = _near(about, fine.resolution)
    foot = _wheels(robot, made_for)[maps.leg]
    row, col = (int(i) for i in fine.cell(foot[0], foot[1]))
    if not (0 <= row < fine.rows and 0 <= col < fine.cols) or within[row, col]:
        return everywhere
    return _read(within, fine, grid)


def _near(about: Array, resolution: float) -> Mask:
    """Cells that lie within its own distance of any cell; about: (rows, cols) distances [m], 0: of none."""
    out = np.zeros(about.shape, bool)
    steps = np.ceil(about / STEP).astype(int)
    for step in np.unique(steps[steps > 0]):
        away = np.asarray(distance_transform_edt(steps != step)) * resolution
        out |= away <= step * STEP
    return out


def _read(within: Mask, fine: GridGeometry, grid: GridGeometry) -> Mask:
    rows, cols = fine.cell(grid.xs[None, :], grid.ys[:, None])
    rows, cols = (np.broadcast_to(one, grid.shape) for one in (rows, cols))
    return within[np.clip(rows, 0, fine.rows - 1), np.clip(cols, 0, fine.cols - 1)]


def _under_wheels(robot: Robot, made_for: RobotState, beside: float) -> Array:
    centers = _wheels(robot, made_for)
    return np.column_stack([centers[:, :2], np.full(len(centers), _wheel(robot) + beside)])


def _wheels(robot: Robot, made_for: RobotState) -> Array:
    T_site_base = made_for.T_site_base
    return wheel_centers(robot, made_for.posture) @ T_site_base[:3, :3].T + T_site_base[:3, 3]


def _hip(robot: Robot, made_for: RobotState, leg: int) -> Array:
    return (made_for.T_site_base @ robot.description.legs[leg].T_base_hip)[:3, 3]


def _wheel(robot: Robot) -> float:
    return float(np.hypot(robot.wheel_radius, robot.description.wheel_width))


def _stretched(robot: Robot, leg: int) -> float:
    """Farthest that anything of a leg can be from its hip, its links as thick as the wheel is large [m]."""
    return float(robot.description.legs[leg].reaches[-1]) + 2.0 * _wheel(robot)
