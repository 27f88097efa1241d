"""The planned way of a foot: the centre of its wheel or sole at every waypoint, one colour for each phase."""

import numpy as np
import viser

from footfall.core.frames import apply
from footfall.planning.legged.problem import LeggedPlan
from footfall.planning.motion import BODY
from footfall.planning.step.problem import StepPlan
from footfall.robot.foot_centers import soles
from footfall_ui.scene.any_robot import AnyRobot
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near

COLORS = {"lift": (255, 190, 60), "swing": (90, 200, 255), "lower": (200, 130, 255)}
"""A foot that stands while the chassis moves has no way."""


class PathDrawing:
    """Line segments from waypoint to waypoint, made anew for another plan."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""

    def show(self, robot: AnyRobot, plan: StepPlan | LeggedPlan) -> None:
        if self._of == plan.digest:
            return
        motion = plan.motion
        leg = plan.leg if isinstance(plan, StepPlan) else plan.moves[0]
        rows = zip(motion.waypoints, motion.Ts_site_base, strict=True)
        points = np.array([apply(T_site_base, soles(robot, posture)[leg]) for posture, T_site_base in rows])
        goes = [row for row, phase in enumerate(motion.phases) if row > 0 and phase != BODY]
        colors = np.array([COLORS[motion.phases[row]] for row in goes], np.uint8)
        local, middle = near(np.stack([points[:-1], points[1:]], axis=1)[np.array(goes, int) - 1])
        self._drawn.add(
            self._server.scene.add_line_segments,
            "/plan/path",
            local,
            np.repeat(colors[:, None, :], 2, axis=1),
            thickness=3.0,
            thickness_units="screen",
            position=middle,
        )
        self._of = plan.digest

    def hide(self) -> None:
        self._of = ""
        self._drawn.clear()
