"""The second ghost: where the rover was to be in the row that it carries out, against where it says it is."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.planning.between_rows import base_path
from footfall.sequence.commands import Sequence
from footfall.session.log.fold import SessionState
from footfall.telemetry.state import RobotState
from footfall_ui.scene.any_robot import AnyRobot, DrawnRobot, drawn_robot, size
from footfall_ui.scene.drawn import Drawn

COLOR = (170, 150, 255)
OVER_CHASSIS = 0.6
LABEL = "/predicted-text"


@dataclass(frozen=True)
class Alongside:
    """The predicted place nearest to the measured one: posture (joints,) [rad or m], T_site_base (4, 4).

    text: by how much the worst joint and the chassis are beside it.
    """

    posture: NDArray[np.float64]
    T_site_base: NDArray[np.float64]
    text: str


def row_under_way(state: SessionState) -> int | None:
    """Of the run that goes, the row that was sent last; None where none does."""
    run = state.run
    if run is None or run.state == "ended":
        return None
    return max((one.row for one in state.commands if one.run == run.number), default=None)


def alongside(robot: AnyRobot, sequence: Sequence, row: int, state: RobotState) -> Alongside:
    """Time says little of how far a row is; the measured joints, projected on its way, say it."""
    begin = sequence.predicted[row - 1] if row else sequence.start
    T_begin = sequence.poses[row - 1] if row else sequence.T_site_base
    way = sequence.predicted[row] - begin
    length = float(way @ way)
    share = float(np.clip((state.posture - begin) @ way / length, 0.0, 1.0)) if length > 0 else 1.0
    posture = begin + share * way
    T_site_base = base_path(T_begin, sequence.poses[row], np.array([share]))[0]
    beside = state.posture - posture
    worst = int(np.argmax(np.abs(beside)))
    apart = float(np.linalg.norm(state.T_site_base[:3, 3] - T_site_base[:3, 3]))
    name = robot.joint_names[worst].removesuffix("_joint").replace("_", " ")
    slides = robot.joint_names[worst] in robot.layout.sliding
    off = f"{1000 * beside[worst]:+z.1f} mm" if slides else f"{np.rad2deg(beside[worst]):+z.2f}°"
    text = f"row {row + 1}: {name} {off}, chassis {1000 * apart:z.0f} mm from predicted"
    return Alongside(posture, T_site_base, text)


class PredictedDrawing:
    """A see-through copy of the rover, and the numbers over it."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawing: DrawnRobot | None = None
        self._drawn = Drawn(server)

    def show(self, robot: AnyRobot, there: Alongside) -> None:
        if self._drawing is None:
            self._drawing = drawn_robot(self._server, robot, "predicted", color=COLOR, opacity=0.3)
        self._drawing.place(there.posture, there.T_site_base)
        place = there.T_site_base[:3, 3] + [0.0, 0.0, OVER_CHASSIS * size(robot)]
        self._drawn.add(self._server.scene.add_label, LABEL, there.text, position=place)

    def hide(self) -> None:
        """Take it away: it is seldom wanted, and another robot may come."""
        self._drawn.clear()
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None
