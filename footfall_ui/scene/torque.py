"""How hard the joints work: a ball at each joint, coloured and larger by its share of the torque limit."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import apply
from footfall.core.mesh import Mesh
from footfall.robot.description import JOINTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.rounded import turned
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import HERE

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
RINGS, SIDES = 8, 16
"""Of a ball."""
BALL_LEVELS = ((6.0, 0.3),)
"""From that distance of the camera on [m], that share of a ball's triangles is drawn."""


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


def ball(radius: float) -> Mesh:
    """About the origin [m]."""
    up = np.linspace(-np.pi / 2, np.pi / 2, RINGS + 2)[1:-1]
    return turned(radius * np.column_stack([np.sin(up), np.cos(up)]), 2, SIDES)


class TorqueDrawing:
    """Balls at the joints of a drawn rover, a batch of them for each level; they go with it."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle, robot: Robot, name: str = "rover") -> None:
        self._server, self._robot, self._root = server, robot, f"/{name}/torques"
        self._drawn = Drawn(server)
        self._batches: dict[str, viser.BatchedMeshHandle] = {}
        self._shown: WorstJoint | None = None

    def show(self, state: RobotState) -> None:
        poses = link_poses(self._robot, state.posture)
        joints = [poses[link_name(leg, part)][:3, 3] for leg in self._robot.legs for part, _ in JOINTS]
        levels = [level(float(share)) for share in torque_shares(self._robot, state)]
        with self._server.atomic():
            for name in LEVELS:
                self._put(name, np.array([at for at, found in zip(joints, levels, strict=True) if found == name]))
        worst = worst_joint(self._robot, state)
        if worst is None:
            self._shown = None
        elif not worst.is_like(self._shown):
            self._drawn.add(self._server.scene.add_label, LABEL, worst.text, position=worst.point)
            self._shown = worst
        shown = [f"{self._root}/{name}" for name in LEVELS if name in levels]
        self._batches = {name: one for name, one in self._batches.items() if name in levels}
        self._drawn.only([*shown, *([] if worst is None else [LABEL])])

    def _put(self, name: str, places: NDArray[np.float64]) -> None:
        """All balls of a level, (n, 3), base frame [m]; a batch of another size is made anew."""
        if not len(places):
            return
        batch = self._batches.get(name)
        if batch is not None and len(batch.batched_positions) == len(places):
            batch.batched_positions = places.astype(np.float32)
            return
        color, radius = LEVELS[name]
        mesh = ball(radius)
        self._batches[name] = self._drawn.add(
            self._server.scene.add_batched_meshes_simple,
            f"{self._root}/{name}",
            mesh.vertices.astype(np.float32),
            mesh.triangles.astype(np.uint32),
            np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1)),
            places,
            position=HERE,
            batched_colors=color,
            lod=BALL_LEVELS,
            cast_shadow=False,
            receive_shadow=False,
        )

    def hide(self) -> None:
        self._batches, self._shown = {}, None
        self._drawn.clear()
