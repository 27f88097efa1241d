"""How hard the joints work: a ball at each joint, coloured and larger by its share of the torque limit."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import apply
from footfall.robot.description import JOINTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall_ui.scene.drawn import Drawn

LABELLED_FROM = 0.7
"""Share of its torque limit from which on the worst joint has a label."""
WARN, OVER = 0.8, 1.0
"""Shares from which on a joint is marked."""
LEVELS = {"good": ((40, 200, 90), 0.13), "warn": ((255, 190, 60), 0.17), "over": ((235, 70, 60), 0.21)}
"""Colour and radius [m] of the balls."""
SIGNS = {"good": "", "warn": "▲ ", "over": "✕ over: "}
NEAR = 0.005
"""A label that moves by less stays where it is [m]."""
LABEL = "/torque/worst"


def torque_shares(robot: Robot, state: RobotState) -> NDArray[np.float64]:
    """Measured torque over its limit, of every joint, (legs × 6,)."""
    return np.abs(state.joint_torques) / robot.torque_limits


def level(share: float) -> str:
    """A key of LEVELS."""
    return "over" if share >= OVER else "warn" if share >= WARN else "good"


@dataclass(frozen=True)
class WorstJoint:
    """What its label says, and where it is, site frame (3,) [m]."""

    text: str
    point: NDArray[np.float64]

    def is_like(self, other: "WorstJoint | None") -> bool:
        """Whether nobody would see the difference."""
        return other is not None and self.text == other.text and bool(np.abs(self.point - other.point).max() < NEAR)


def worst_joint(robot: Robot, state: RobotState) -> WorstJoint | None:
    """The joint nearest to its limit; None where it has plenty left."""
    shares = torque_shares(robot, state)
    joint = int(np.argmax(shares))
    if shares[joint] < LABELLED_FROM:
        return None
    part = JOINTS[joint % 6][0]
    place = link_poses(robot, state.posture)[link_name(joint // 6, part)][:3, 3]
    text = f"{SIGNS[level(shares[joint])]}{shares[joint]:.0%} leg {joint // 6} {part.replace('_', ' ')}"
    return WorstJoint(text, apply(state.T_site_base, place))


class TorqueDrawing:
    """Balls on the links of a drawn rover, which carries them along; they go with it."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle, robot: Robot, name: str = "rover") -> None:
        self._server, self._robot = server, robot
        self._balls = [f"/{name}/{link_name(leg, part)}/torque" for leg in robot.legs for part, _ in JOINTS]
        self._drawn = Drawn(server)
        self._levels: dict[str, str] = {}
        self._told: WorstJoint | None = None

    def show(self, state: RobotState) -> None:
        for ball, share in zip(self._balls, torque_shares(self._robot, state), strict=True):
            found = level(float(share))
            if self._levels.get(ball) != found:
                color, radius = LEVELS[found]
                self._drawn.add(
                    self._server.scene.add_icosphere, ball, radius, color, subdivisions=2, cast_shadow=False
                )
                self._levels[ball] = found
        worst = worst_joint(self._robot, state)
        if worst is None:
            self._told = None
        elif not worst.is_like(self._told):
            self._drawn.add(self._server.scene.add_label, LABEL, worst.text, position=worst.point)
            self._told = worst
        self._drawn.only([*self._balls, *([] if worst is None else [LABEL])])

    def hide(self) -> None:
        self._levels, self._told = {}, None
        self._drawn.clear()
