"""A planned walk or gait: a mark at each footfall, numbered in their order and with its leg, and the chassis' way."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.planning.gait.problem import GaitPlan, GaitResult
from footfall.planning.legged.footfalls import footfalls
from footfall.planning.legged.problem import LeggedPlan, LeggedResult
from footfall.planning.walk.problem import WalkPlan, WalkResult, foot_moves_in_words
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall_ui.scene.any_robot import AnyRobot, reach
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

FOOTFALLS, WAY = (255, 170, 70), (120, 220, 255)
SIZE = 0.1
"""Half the length of a mark's arms [m]."""
OVER_GROUND = 0.03
ARM, ABOVE = 0.03, 0.006
"""The same two of a robot that others described, as shares of its reach."""
MARKS, LINE, END = "/walk/marks", "/walk/chassis", "/walk/end"


@dataclass(frozen=True)
class Mark:
    """point: site frame (3,) [m]; text: which foot move, from 1 on, and its leg."""

    point: NDArray[np.float64]
    text: str


def footfall_marks(plan: WalkPlan | GaitPlan) -> tuple[Mark, ...]:
    """Where each foot move puts its feet, in their order."""
    up = np.array([0.0, 0.0, OVER_GROUND])
    placed = zip(plan.groups, plan.stances[1:], strict=True)
    return tuple(
        Mark(stance.contacts[leg] + up, f"{number}: leg {leg}")
        for number, (group, stance) in enumerate(placed, 1)
        for leg in group
    )


def legged_marks(robot: LeggedRobot, plan: LeggedPlan) -> tuple[Mark, ...]:
    """As :func:`footfall_marks`, of a robot that others described: with the names of its legs."""
    up = np.array([0.0, 0.0, ABOVE * reach(robot)])
    found = enumerate(footfalls(robot, plan), 1)
    return tuple(Mark(one.point + up, f"{number}: {robot.leg_names[one.leg]}") for number, one in found)


def chassis_line(Ts_site_base: NDArray[np.float64]) -> NDArray[np.float64]:
    """The way of the chassis' origin through poses (n, 4, 4), site frame (m, 2, 3) [m]; empty where it stays."""
    at = Ts_site_base[:, :3, 3]
    segments = np.stack([at[:-1], at[1:]], axis=1)
    return segments[(segments[:, 0] != segments[:, 1]).any(axis=1)]


def end_text(result: WalkResult | GaitResult | LeggedResult) -> str:
    """What is said where the chassis ends."""
    plan = result.plan or result.partial
    if plan is None:
        return ""
    if isinstance(plan, GaitPlan):
        text = f"{len(plan.groups)} steps of the gait"
        return text if result.plan is not None else f"✕ it comes this far: {text}"
    if isinstance(plan, WalkPlan):
        text = foot_moves_in_words(plan)
    else:
        text = f"{len(plan.moves)} foot move{'' if len(plan.moves) == 1 else 's'}"
    return f"walk: {text}" if result.plan is not None else f"✕ it comes this far: {text}"


class WalkDrawing:
    """The walk or gait that was found, or what comes nearest to the goal."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""

    def show(self, robot: AnyRobot, result: WalkResult | GaitResult | LeggedResult) -> None:
        """robot: whose it is."""
        if self._of == result.digest:
            return
        self._of = ""
        plan = result.plan or result.partial
        if plan is None:
            self._drawn.clear()
            return
        if isinstance(plan, LeggedPlan):
            if not isinstance(robot, LeggedRobot):
                raise TypeError(f"{robot.name} does not walk so")
            self.draw(legged_marks(robot, plan), plan.Ts_site_base, end_text(result), ARM * reach(robot))
        else:
            self.draw(footfall_marks(plan), plan.Ts_site_base, end_text(result))
        self._of = result.digest

    def draw(self, marks: Sequence[Mark], Ts_site_base: NDArray[np.float64], text: str, size: float = SIZE) -> None:
        """Marks at footfalls, the way of a chassis through poses (n, 4, 4), and a text where it ends.

        size: half the length of a mark's arms [m].
        """
        scene, way = self._server.scene, chassis_line(Ts_site_base)
        names = {f"/walk/{number}": mark for number, mark in enumerate(marks, 1)}
        shown = [END, *names]
        self._drawn.add(scene.add_label, END, text, position=Ts_site_base[-1, :3, 3])
        for name, mark in names.items():
            self._drawn.add(scene.add_label, name, mark.text, position=mark.point)
        if marks:
            arms = size * np.array([[[-1, -1, 0], [1, 1, 0]], [[-1, 1, 0], [1, -1, 0]]])
            self._lines(MARKS, np.concatenate([mark.point + arms for mark in marks]), FOOTFALLS)
            shown.append(MARKS)
        if len(way):
            self._lines(LINE, way, WAY)
            shown.append(LINE)
        self._drawn.only(shown)

    def _lines(self, name: str, segments: NDArray[np.float64], color: tuple[int, int, int]) -> None:
        local, middle = near(segments)
        add = self._server.scene.add_line_segments
        self._drawn.add(add, name, local, color, thickness=3.0, thickness_units="screen", position=middle)

    def hide(self) -> None:
        self._of = ""
        self._drawn.clear()
