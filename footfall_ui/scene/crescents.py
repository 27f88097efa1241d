"""Where the stacks of a robot like the Ambler may be over its feet: the crescents that bound their reachable space."""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.planning.legged.stacks import Stack, crescent, stacks_of
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

COLORS = ((120, 220, 255), (255, 140, 220))
"""Of the left stack and the right one."""


class CrescentDrawing:
    """Nothing is drawn for a robot without stacks."""

    def __init__(self, server: viser.ViserServer, robot: LeggedRobot) -> None:
        self._server, self._drawn, self._stacks = server, Drawn(server), _stacks(robot)

    def show(self, soles: NDArray[np.float64], legs: tuple[int, ...]) -> None:
        """soles: centres of all soles, (legs, 3) in site [m]; legs: those that stand. Drawn at the lowest of them."""
        for number, stack in enumerate(self._stacks):
            pieces = crescent(stack, soles, legs)
            level = np.full((*pieces.shape[:2], 1), float(soles[list(legs), 2].min()))
            points, middle = near(np.concatenate([pieces, level], axis=2))
            self._drawn.add(
                self._server.scene.add_line_segments,
                f"/crescents/{number}",
                points,
                COLORS[number],
                thickness=2.0,
                thickness_units="screen",
                position=middle,
            )


def _stacks(robot: LeggedRobot) -> tuple[Stack, ...]:
    try:
        return stacks_of(robot)
    except InvalidInput:
        return ()
