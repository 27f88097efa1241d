"""A soft shadow of the rover straight down on the ground: it tells how high a foot hangs, not where the sun is."""

import numpy as np
import viser

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.mesh import Mesh
from footfall.robot.foot_centers import soles
from footfall.session.live import LiveSession
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene.any_robot import AnyRobot, chassis_width, size, sole_radius
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.glb import unlit_glb
from footfall_ui.scene.of_session import read, rover_state

SPACING, TEXELS = 0.1, 96
"""Of its vertices [m]; of its picture, along a side. Lengths are those of ATHLETE, here and below."""
OVER = 0.03
"""Over the ground [m]."""
MARGIN = 0.6
"""Around the outermost wheels [m]."""
CHASSIS, WHEEL = 0.4, 0.55
"""Opacity under the middle of the chassis, and under a wheel that stands."""
SOFT = 1.5
"""Radius of a wheel's shadow beside the wheel's."""
FADES = 0.4
"""A wheel so high over the ground has no shadow any more [m]."""
MOVED = 0.02
"""A shadow is drawn anew where chassis or a wheel has moved by more [m]."""
NAME = "/shadow"


def opacity(x: Array, y: Array, ground: Array, robot: AnyRobot, state: RobotState) -> Array:
    """Of the shadow at places (n,), x and y, site frame [m], over ground of that height [m]: 0…1, (n,)."""
    middle = state.T_site_base[:3, 3]
    width = chassis_width(robot) / 2
    light = 1.0 - CHASSIS * np.exp(-((np.hypot(x - middle[0], y - middle[1]) / width) ** 4))
    for leg, foot in enumerate(apply(state.T_site_base, soles(robot, state.posture))):
        radius = sole_radius(robot, leg)
        away = np.hypot(x - foot[0], y - foot[1]) / (SOFT * radius)
        hangs = np.clip((foot[2] - radius - ground) / (FADES * size(robot)), 0.0, 1.0)
        light *= 1.0 - WHEEL * (1.0 - hangs) * np.exp(-(away**2))
    return 1.0 - light


def shadow_glb(dem: Dem, robot: AnyRobot, state: RobotState) -> bytes | None:
    """A patch that lies on the ground under the rover; None where nothing is known of the ground there."""
    feet, large = apply(state.T_site_base, soles(robot, state.posture))[:, :2], size(robot)
    low, high = feet.min(axis=0) - MARGIN * large, feet.max(axis=0) + MARGIN * large
    x, y = (np.linspace(a, b, int(np.ceil((b - a) / (SPACING * large))) + 1) for a, b in zip(low, high, strict=True))
    heights = height_at(dem, x, y[:, None])
    known = np.isfinite(heights)
    squares = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    if not squares.any():
        return None
    corner = np.arange(heights.size).reshape(heights.shape)[:-1, :-1][squares]
    lower = np.column_stack([corner, corner + 1, corner + len(x) + 1])
    upper = np.column_stack([corner, corner + len(x) + 1, corner + len(x)])
    vertices = np.stack([*np.meshgrid(x, y), np.where(known, heights + OVER * large, 0.0)], axis=-1).reshape(-1, 3)
    used, index = np.unique(np.concatenate([lower, upper]), return_inverse=True)
    mesh = Mesh(vertices[used], index.reshape(-1, 3).astype(np.int32))
    across, along = (np.linspace(a, b, TEXELS) for a, b in zip(low, high, strict=True))
    east, north = (one.ravel() for one in np.meshgrid(across, along))
    beneath = np.nan_to_num(height_at(dem, east, north), nan=float(np.nanmin(heights)))
    picture = np.zeros((TEXELS, TEXELS, 4), np.uint8)
    picture[..., 3] = np.rint(255 * opacity(east, north, beneath, robot, state)).reshape(TEXELS, TEXELS)
    share = (mesh.vertices[:, :2] - low) / (high - low)
    return unlit_glb(mesh, (0.5 + share * (TEXELS - 1)) / TEXELS, picture)


class ShadowDrawing:
    """Under where the rover says it is."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: tuple[str, Array] | None = None

    def draw(self, live: LiveSession) -> None:
        """Made anew where the rover has moved, or the ground is another."""
        state = rover_state(live)
        if state is None or live.state.dem is None:
            self._of = None
            self._drawn.clear()
            return
        robot = live.any_robot
        places = np.vstack([state.T_site_base[:3, 3], apply(state.T_site_base, soles(robot, state.posture))])
        if self._of is not None and self._of[0] == live.state.dem and _alike(self._of[1], places, MOVED * size(robot)):
            return
        self._of = None
        content = shadow_glb(read(live, live.state.dem, Dem), robot, state)
        if content is None:
            self._drawn.clear()
        else:
            self._drawn.add(self._server.scene.add_glb, NAME, content, cast_shadow=False, receive_shadow=False)
        self._of = live.state.dem, places


def _alike(before: Array, now: Array, moved: float) -> bool:
    return before.shape == now.shape and float(np.abs(now - before).max()) <= moved
