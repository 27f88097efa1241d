"""A robot that others described: a frame and the collision shapes of each of its bodies, moved in place."""

from collections.abc import Collection

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import quat_wxyz
from footfall.core.mesh import Mesh
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.painted import Color
from footfall_ui.scene.robot import BODY, CHOSEN, COLLIDING


class LeggedDrawing:
    """Draws what the planner checks under ``/<name>``: the collision shapes. A body without any is not there to be
    seen.
    """

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        robot: LeggedRobot,
        name: str = "robot",
        leg: int | None = None,
        color: Color | None = None,
        opacity: float | None = None,
    ) -> None:
        """leg: the one that alone is drawn; None: all of the robot. opacity: None where it is not see-through."""
        self._server, self._robot, self._color = server, robot, color or BODY
        self._drawn = Drawn(server)
        scene = server.scene
        self._root = self._drawn.add(scene.add_frame, f"/{name}", show_axes=False, visible=False)
        bodies = range(len(robot.body_names)) if leg is None else bodies_of(robot, leg)
        self._frames = {body: scene.add_frame(f"/{name}/{body}", show_axes=False) for body in bodies}
        self._meshes = {
            body: [
                scene.add_mesh_simple(
                    f"/{name}/{body}/{part}",
                    shape.vertices.astype(np.float32),
                    shape.triangles.astype(np.uint32),
                    color=self._color,
                    opacity=opacity,
                    flat_shading=True,
                    side="double",
                    cast_shadow=False,
                    receive_shadow=False,
                )
                for part, shape in enumerate(robot.shapes[body])
            ]
            for body in bodies
        }

    def place(self, posture: NDArray[np.float64], T_site_base: NDArray[np.float64]) -> None:
        """Move all bodies to a posture (joints,) [rad or m] and a pose of the base."""
        Ts_base_body = placed(self._robot, posture).Ts_base_body
        with self._server.atomic():
            self._root.position = T_site_base[:3, 3]
            self._root.wxyz = quat_wxyz(T_site_base[:3, :3])
            for body, frame in self._frames.items():
                frame.position = Ts_base_body[body, :3, 3]
                frame.wxyz = quat_wxyz(Ts_base_body[body, :3, :3])
            self._root.visible = True

    def highlight(self, chosen: Collection[str], colliding: Collection[str] = ()) -> None:
        """Colour the chosen bodies, by their numbers, apart from the rest, and those that would collide from both."""
        for body, meshes in self._meshes.items():
            color = COLLIDING if str(body) in colliding else CHOSEN if str(body) in chosen else self._color
            for mesh in meshes:
                if tuple(mesh.color) != color:
                    mesh.color = color

    def hide(self) -> None:
        self._root.visible = False

    def remove(self) -> None:
        """Take it away."""
        self._drawn.clear()


def bodies_of(robot: LeggedRobot, leg: int) -> range:
    """Numbers of the bodies that the joints of one leg move."""
    own = robot.slices[leg]
    return range(1 + own.start, 1 + own.stop)


def body_mesh(robot: LeggedRobot, body: int) -> Mesh:
    """All shapes of a body as one mesh, in its frame."""
    shapes = robot.shapes[body]
    before = np.cumsum([0, *(len(one.vertices) for one in shapes[:-1])])
    triangles = [one.triangles + begin for one, begin in zip(shapes, before, strict=True)]
    return Mesh(np.concatenate([one.vertices for one in shapes]), np.concatenate(triangles).astype(np.int32))
