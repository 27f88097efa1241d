"""The tracks: a dark print where each foot was put down so far, of a wheel with treads across."""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import apply
from footfall.robot.foot_centers import soles
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.model import Robot
from footfall.session.live import LiveSession
from footfall.session.tracks import Step, tracks
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene.any_robot import AnyRobot, size, sole_radius
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.of_session import read

COLOR, PRINTS = (24, 20, 16), "/tracks/prints"
HALF, TREADS, OVER = (0.16, 0.08), 6, 0.01
"""Half the length and width of a wheel's print, its lines across, and its height over the ground [m]."""
AROUND = 12
"""Lines of a round foot's print."""
MOST = 300
"""Prints; older ones are left out."""


def print_lines(robot: AnyRobot, dem: Dem, step: Step) -> NDArray[np.float64]:
    """The outline of one print on the ground, of a wheel with its treads, (n, 2, 3) [m]; no lines where no ground is
    known.
    """
    xy = _round_print(robot, step) if isinstance(robot, LeggedRobot) else _wheel_print(robot, step)
    z = height_at(dem, xy[..., 0], xy[..., 1]) + OVER * size(robot)
    known = np.isfinite(z).all(axis=1)
    return np.concatenate([xy, z[..., None]], axis=2)[known]


def _round_print(robot: LeggedRobot, step: Step) -> NDArray[np.float64]:
    middle = apply(step.T_site_base, soles(robot, step.posture))[step.leg, :2]
    angle = np.linspace(0.0, 2 * np.pi, AROUND + 1)
    rim = middle + sole_radius(robot, step.leg) * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.stack([rim[:-1], rim[1:]], axis=1)


def _wheel_print(robot: Robot, step: Step) -> NDArray[np.float64]:
    own = slice(6 * step.leg, 6 * step.leg + 6)
    T_site_wheel = step.T_site_base @ leg_wheel_pose(robot, step.posture[own], step.leg)
    center, axle = T_site_wheel[:2, 3], T_site_wheel[:2, 1]
    across = axle / max(float(np.linalg.norm(axle)), 1e-9)
    along = np.array([-across[1], across[0]])
    a, b = HALF
    corners = np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    at = np.linspace(-a, a, TREADS + 2)[1:-1]
    treads = np.array([[(x, -b), (x, b)] for x in at])
    flat = np.concatenate([np.stack([corners, np.roll(corners, -1, axis=0)], axis=1), treads])
    return center + flat[..., :1] * along + flat[..., 1:] * across


class TracksDrawing:
    """Made anew when a foot was put down, or the ground is another."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: tuple[str, int] | None = None

    def draw(self, live: LiveSession) -> None:
        """As the view has it."""
        if live.state.dem is None or not live.choices.view.shown.tracks:
            self._of = None
            self._drawn.clear()
            return
        of = live.state.dem, sum(one.state == "done" for one in live.state.commands)
        if of == self._of:
            return
        self._of = None
        steps = tracks(live.state.commands, live.get)[-MOST:]
        dem = read(live, live.state.dem, Dem)
        lines = [print_lines(live.any_robot, dem, step) for step in steps]
        segments = np.concatenate(lines) if lines else np.zeros((0, 2, 3))
        if len(segments):
            local, middle = near(segments)
            add = self._server.scene.add_line_segments
            self._drawn.add(add, PRINTS, local, COLOR, thickness=2.5, thickness_units="screen", position=middle)
        else:
            self._drawn.clear()
        self._of = of
