"""What the ground does to the wheels: an arrow at each, as long as the force is large."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.telemetry.state import RobotState
from footfall_ui.scene.any_robot import AnyRobot, heft, leg_name, lowest, size
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.still import stands_still

METRES_PER_NEWTON = 5e-4
"""Of ATHLETE; with another weight as long beside the robot, so that its share of the weight is seen. So are the other
lengths and forces here."""
LEAST = 20.0
"""A force below this has no arrow [N]."""
CHANGE = 10.0
"""A force that changes by less is not drawn anew [N]."""
OUTSIDE = 0.35
"""Of an arrow from its contact, away from the chassis: the leg would hide it [m]."""
SHAFT, HEAD = 0.025, 0.06
"""Radii of an arrow [m]."""
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


def force_arrows(robot: AnyRobot, state: RobotState) -> Arrows:
    """Of the wheels on which the ground acts at all."""
    newtons = np.linalg.norm(state.wheel_forces, axis=1)
    legs = tuple(leg for leg in robot.legs if newtons[leg] >= LEAST * heft(robot))
    contacts = [lowest(robot, state.posture, leg, state.T_site_base) for leg in legs]
    starts = [_beside(contact, state, OUTSIDE * size(robot)) for contact in contacts]
    length = METRES_PER_NEWTON * size(robot) / heft(robot)
    tips = [start + length * state.wheel_forces[leg] for start, leg in zip(starts, legs, strict=True)]
    return Arrows(np.array([*zip(starts, tips, strict=True)]).reshape(-1, 2, 3), legs, newtons[list(legs)])


def _beside(contact: NDArray[np.float64], state: RobotState, outside: float) -> NDArray[np.float64]:
    away = (contact - state.T_site_base[:3, 3]) * [1.0, 1.0, 0.0]
    return contact + outside * away / max(float(np.linalg.norm(away)), 1e-9)


class ForcesDrawing:
    """Arrows beside the contacts, and the number at the chosen leg's."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: tuple[RobotState, int] | None = None

    def show(self, robot: AnyRobot, state: RobotState, chosen: int) -> None:
        """chosen: the leg whose force is told."""
        if self._of is not None and self._of[1] == chosen and _alike(robot, self._of[0], state):
            return
        self._of = None
        arrows, names = force_arrows(robot, state), []
        scene = self._server.scene
        with self._server.atomic():
            if arrows.legs:
                names.append(ARROWS)
                local, middle = near(arrows.points)
                shaft, head = SHAFT * size(robot), HEAD * size(robot)
                self._drawn.add(
                    scene.add_arrows, ARROWS, local, COLOR, shaft_radius=shaft, head_radius=head, position=middle
                )
            if chosen in arrows.legs:
                names.append(LABEL)
                at = arrows.legs.index(chosen)
                text = f"{leg_name(robot, chosen)}: {arrows.newtons[at]:z.0f} N"
                self._drawn.add(scene.add_label, LABEL, text, position=arrows.points[at, 1])
            self._drawn.only(names)
        self._of = state, chosen

    def hide(self) -> None:
        self._of = None
        self._drawn.clear()


def _alike(robot: AnyRobot, before: RobotState, now: RobotState) -> bool:
    if not stands_still(before, now):
        return False
    return float(np.abs(before.wheel_forces - now.wheel_forces).max()) < CHANGE * heft(robot)
