"""The ghost: where the moving leg, or the whole rover, will be at a moment of what is planned."""

import viser

from footfall.core.value import Value
from footfall.planning.between_rows import at
from footfall.planning.legged.problem import LeggedPlan, LeggedResult
from footfall.planning.motion import Motion
from footfall.planning.step.problem import PlanResult, StepPlan
from footfall.planning.walk.problem import WalkPlan, WalkResult
from footfall.sequence.commands import Sequence
from footfall_ui.scene.any_robot import AnyRobot, DrawnRobot, drawn_robot
from footfall_ui.scene.robot import GHOST


class GhostDrawing:
    """A see-through copy of one leg, or of all and the chassis, made anew where another one moves."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawing: DrawnRobot | None = None
        self._leg: int | None = None

    def show(self, robot: AnyRobot, motion: Motion, moment: float) -> None:
        """moment: 0…1 along the motion; between waypoints the joints move in straight lines."""
        leg = motion.leg
        if self._drawing is None or self._leg != leg:
            self.hide()
            self._drawing = drawn_robot(self._server, robot, "ghost", leg, GHOST, opacity=0.55)
            self._leg = leg
        self._drawing.place(*at(motion, moment))

    def hide(self) -> None:
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None


def motion_of(value: Value | None) -> Motion | None:
    """What a ghost plays of a plan, a walk or a sequence; None of anything else. Of a walk that was not found it is the
    part that was.
    """
    if isinstance(value, PlanResult):
        return motion_of(value.plan)
    if isinstance(value, (WalkResult, LeggedResult)):
        return motion_of(value.plan or value.partial)
    if isinstance(value, (StepPlan, WalkPlan, LeggedPlan)) or (isinstance(value, Sequence) and value.commands):
        return value.motion
    return None
