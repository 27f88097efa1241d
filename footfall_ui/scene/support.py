"""What the rover stands on: the support polygons of its contacts, the centre of mass, and by how much it stands."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.balance.support import conservative_polygon, margins, support_polygon
from footfall.core.frames import apply
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.still import stands_still

COLORS = {"plain": (90, 200, 255), "conservative": (255, 255, 255)}
MASS = (255, 120, 120)
OVER_GROUND = 0.03
"""Of the outlines [m]."""
LEAST_SHARE = 0.01
"""Of the rover's weight; a wheel that bears less stands on nothing."""
ARM = 0.1
"""Of the cross under the centre of mass [m]."""


@dataclass(frozen=True)
class Stance:
    """rings: name → corners on the ground, (m, 3) [m]; com: the centre of mass, foot: under it, (3,).

    margins: name → of the centre of mass to that polygon [m], −inf where there is none.
    """

    rings: Mapping[str, NDArray[np.float64]]
    com: NDArray[np.float64]
    foot: NDArray[np.float64]
    margins: Mapping[str, float]

    @property
    def text(self) -> str:
        """The margins, in words."""
        plain, careful = (self.margins[name] for name in COLORS)
        if not np.isfinite(plain):
            return "margin: too few wheels stand"
        after_loss = f"{careful:.2f} m" if np.isfinite(careful) else "none"
        return f"{'margin' if plain >= 0 else '✕ margin'} {plain:.2f} m, with any one leg lost {after_loss}"


def standing(robot: Robot, state: RobotState) -> list[int]:
    """Legs whose wheels bear a share of the rover; all of them where no force is known."""
    up = state.wheel_forces[:, 2]
    least = LEAST_SHARE * float(up.sum())
    return [leg for leg in robot.legs if up[leg] > least] if least > 0 else list(robot.legs)


def stance_of(robot: Robot, state: RobotState) -> Stance:
    """Of the wheels that stand, each touching at its lowest point."""
    legs = standing(robot, state)
    contacts = np.array([contact_point(robot, state.posture, leg, state.T_site_base) for leg in legs])
    com = apply(state.T_site_base, center_of_mass(robot, state.posture))
    z = float(contacts[:, 2].mean()) + OVER_GROUND
    rings, spare = {}, {}
    for name, polygon in (("plain", support_polygon), ("conservative", conservative_polygon)):
        corners = polygon(contacts[:, :2])
        rings[name] = np.column_stack([corners, np.full(len(corners), z)])
        spare[name] = float(margins(contacts[:, :2], com[None, :2], name == "conservative")[0])
    return Stance(rings, com, np.array([com[0], com[1], z]), spare)


class SupportDrawing:
    """Polygon outlines at the mean height of the contacts; a plumb line from the centre of mass, and the margins."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: tuple[RobotState, list[int]] | None = None

    def show(self, robot: Robot, state: RobotState) -> None:
        legs = standing(robot, state)
        if self._of is not None and self._of[1] == legs and stands_still(self._of[0], state):
            return
        self._of = None
        stance = stance_of(robot, state)
        cross = np.array([[[-ARM, 0, 0], [ARM, 0, 0]], [[0, -ARM, 0], [0, ARM, 0]]]) + stance.foot
        plumb = np.concatenate([cross, [[stance.com, stance.foot]]])
        lines: dict[str, tuple[np.ndarray, tuple[int, int, int]]] = {"com": (plumb, MASS)}
        for name, ring in stance.rings.items():
            if len(ring) > 1:
                lines[name] = (np.stack([ring, np.roll(ring, -1, axis=0)], axis=1), COLORS[name])
        with self._server.atomic():
            for name, (segments, color) in lines.items():
                self._drawn.keep(
                    self._server.scene.add_line_segments(
                        f"/support/{name}", segments, color, thickness=2.5, thickness_units="screen"
                    )
                )
            self._drawn.keep(self._server.scene.add_label("/support/margin", stance.text, position=stance.foot))
            self._drawn.only([*(f"/support/{name}" for name in lines), "/support/margin"])
        self._of = state, legs

    def hide(self) -> None:
        self._of = None
        self._drawn.clear()
