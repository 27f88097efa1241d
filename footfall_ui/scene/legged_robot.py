"""A robot that others described: a frame and the collision shapes of each of its bodies, moved in place."""

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import quat_wxyz
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.robot import BODY, CHOSEN


class LeggedDrawing:
    """Draws what the planner checks: the collision shapes. A body without any is not there to be seen."""

    def __init__(self, server: viser.ViserServer, robot: LeggedRobot) -> None:
        self._server, self._robot = server, robot
        self._drawn = Drawn(server)
        scene = server.scene
        self._root = self._drawn.add(scene.add_frame, "/robot", show_axes=False)
        self._frames = [scene.add_frame(f"/robot/{number}", show_axes=False) for number in range(len(robot.body_names))]
        self._meshes = [
            [
                scene.add_mesh_simple(
                    f"/robot/{number}/{part}",
                    shape.vertices.astype(np.float32),
                    shape.triangles.astype(np.uint32),
                    color=BODY,
                    flat_shading=True,
                    side="double",
                    cast_shadow=False,
                    receive_shadow=False,
                )
                for part, shape in enumerate(shapes)
            ]
            for number, shapes in enumerate(robot.shapes)
        ]

    def place(self, posture: NDArray[np.float64], T_site_base: NDArray[np.float64]) -> None:
        """Move all bodies to a posture (joints,) [rad or m] and a pose of the base."""
        with self._server.atomic():
            self._root.position = T_site_base[:3, 3]
            self._root.wxyz = quat_wxyz(T_site_base[:3, :3])
            for frame, T_base_body in zip(self._frames, placed(self._robot, posture).Ts_base_body, strict=True):
                frame.position = T_base_body[:3, 3]
                frame.wxyz = quat_wxyz(T_base_body[:3, :3])

    def choose(self, leg: int) -> None:
        """Colour one leg apart from the rest; −1: none."""
        joints = range(0) if leg < 0 else range(*self._robot.slices[leg].indices(len(self._robot.joint_names)))
        for number, meshes in enumerate(self._meshes):
            color = CHOSEN if number - 1 in joints else BODY
            for mesh in meshes:
                if tuple(mesh.color) != color:
                    mesh.color = color
