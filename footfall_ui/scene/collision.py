"""What a refused plan would have brought together: the pair that its checks, or its reason, name."""

import re
from collections.abc import Collection

import viser

from footfall.core.frames import apply
from footfall.planning.step.problem import PlanResult
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall_ui.scene.drawn import Drawn

_WORDS = re.compile(r"\w+")
LABEL = "/collision/text"


def colliding(result: PlanResult, links: Collection[str]) -> tuple[str, ...]:
    """The links that refuse the plan: two, one where the other is the ground, none where no collision is named.

    links: names of the robot's links, of which checks and reasons are written.
    """
    if result.plan is not None:
        return ()
    where = [check.where for check in result.checks if not check.holds and "collision" in check.name]
    for text in [*where, *result.reason.split(";")]:
        named = [word for word in _WORDS.findall(text) if word in links]
        if named:
            return tuple(dict.fromkeys(named))[:2]
    return ()


class CollisionDrawing:
    """The pair's names at the first of them; their colour is the rover's to draw."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)

    def show(self, robot: Robot, state: RobotState, pair: tuple[str, ...]) -> None:
        """pair: see :func:`colliding`."""
        place = apply(state.T_site_base, link_poses(robot, state.posture)[pair[0]][:3, 3])
        names = " × ".join(name.replace("_", " ") for name in pair)
        text = f"✕ refused: {names}{'' if len(pair) > 1 else ' × ground'}"
        self._drawn.add(self._server.scene.add_label, LABEL, text, position=place)

    def hide(self) -> None:
        self._drawn.clear()
