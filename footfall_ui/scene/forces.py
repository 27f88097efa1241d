"""What the ground does to the wheels: an arrow at each, as long as the force is large."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.robot.ik import contact_point
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.still import stands_still

METRES_PER_NEWTON = 5e-4
LEAST = 20.0
"""A force below this has no arrow [N]."""
CHANGE = 10.0
"""A force that changes by less is not drawn anew [N]."""
OUTSIDE = 0.35
"""Of an arrow from its contact, away from the chassis: the leg would hide it [m]."""
COLOR = (120, 230, 255)
ARROWS, LABEL = "/forces/arrows", "/forces/text"


@dataclass(frozen=True)
class Arrows:
    """points: (n, 2, 3), from beside the contact to the tip, site frame [m]; legs: (n,) whose they are.

    newtons: (n,) how large the forces are.
    """

    points: NDArray[np.float64]
    legs: tuple[int, ...]
    newtons: NDArray[np.float64]


def force_arrows(robot: Robot, state: RobotState) -> Arrows:
    """Of the wheels on which the ground acts at all."""
    newtons = np.linalg.norm(state.wheel_forces, axis=1)
    legs = tuple(leg for leg in robot.legs if newtons[leg] >= LEAST)
    starts = [_beside(contact_point(robot, state.posture, leg, state.T_site_base), state) for leg in legs]
    tips = [start + METRES_PER_NEWTON * state.wheel_forces[leg] for start, leg in zip(starts, legs, strict=True)]
    return Arrows(np.array([*zip(starts, tips, strict=True)]).reshape(-1, 2, 3), legs, newtons[list(legs)])


def _beside(contact: NDArray[np.float64], state: RobotState) -> NDArray[np.float64]:
    away = (contact - state.T_site_base[:3, 3]) * [1.0, 1.0, 0.0]
    return contact + OUTSIDE * away / np.linalg.norm(away)


class ForcesDrawing:
    """Arrows beside the contacts, and the number at the chosen leg's."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: tuple[RobotState, int] | None = None

    def show(self, robot: Robot, state: RobotState, chosen: int) -> None:
        """chosen: the leg whose force is told."""
        if self._of is not None and self._of[1] == chosen and _alike(self._of[0], state):
            return
        self._of = None
        arrows, names = force_arrows(robot, state), []
        scene = self._server.scene
        with self._server.atomic():
            if arrows.legs:
                names.append(ARROWS)
                local, middle = near(arrows.points)
                self._drawn.add(
                    scene.add_arrows, ARROWS, local, COLOR, shaft_radius=0.025, head_radius=0.06, position=middle
                )
            if chosen in arrows.legs:
                names.append(LABEL)
                at = arrows.legs.index(chosen)
                text = f"leg {chosen}: {arrows.newtons[at]:z.0f} N"
                self._drawn.add(scene.add_label, LABEL, text, position=arrows.points[at, 1])
            self._drawn.only(names)
        self._of = state, chosen

    def hide(self) -> None:
        self._of = None
        self._drawn.clear()


def _alike(before: RobotState, now: RobotState) -> bool:
    return stands_still(before, now) and float(np.abs(before.wheel_forces - now.wheel_forces).max()) < CHANGE
