"""The rover: one frame and one mesh for each link, moved in place; and the ghost of its moving leg."""

from collections.abc import Collection

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import quat_wxyz
from footfall.robot.display import BEAM, DECK, MARK, MOTOR, TYRE, display_parts
from footfall.robot.kinematics import link_poses
from footfall.robot.model import Robot
from footfall_ui.scene.drawn import Drawn

BODY = (226, 228, 232)
CHOSEN = (120, 190, 255)
GHOST = (250, 214, 80)
COLLIDING = (255, 60, 150)
SHADES = {DECK: 1.0, BEAM: 0.86, MOTOR: 0.5, TYRE: 0.3, MARK: 0.7}
"""How bright a material is beside the colour of its link."""
ARROW = (250, 160, 30)
"""Of the mark on the deck that points forward."""


class RobotDrawing:
    """Draws every link of a robot under ``/<name>``; ``links`` limits it to some of them."""

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        robot: Robot,
        name: str = "rover",
        links: set[str] | None = None,
        color: tuple[int, int, int] = BODY,
        opacity: float | None = None,
    ) -> None:
        self._robot = robot
        self._server = server
        self._color = color
        self._drawn = Drawn(server)
        self._root = self._drawn.add(server.scene.add_frame, f"/{name}", show_axes=False, visible=False)
        self._frames: dict[str, viser.FrameHandle] = {}
        self._meshes: dict[tuple[str, str], viser.MeshHandle] = {}
        for link, parts in display_parts(robot.description).items():
            if links is not None and link not in links:
                continue
            self._frames[link] = server.scene.add_frame(f"/{name}/{link}", show_axes=False)
            for part in parts:
                self._meshes[link, part.material] = server.scene.add_mesh_simple(
                    f"/{name}/{link}/{part.material}",
                    part.mesh.vertices.astype(np.float32),
                    part.mesh.triangles.astype(np.uint32),
                    color=shaded(color, part.material),
                    opacity=opacity,
                    flat_shading=True,
                    side="double",
                    cast_shadow=False,
                    receive_shadow=False,
                )

    def place(self, posture: NDArray[np.float64], T_site_base: NDArray[np.float64]) -> None:
        """Move all links to a posture (legs × 6,) [rad] and a chassis pose."""
        with self._server.atomic():
            self._root.position = T_site_base[:3, 3]
            self._root.wxyz = quat_wxyz(T_site_base[:3, :3])
            for link, T_base_link in link_poses(self._robot, posture).items():
                if link in self._frames:
                    self._frames[link].position = T_base_link[:3, 3]
                    self._frames[link].wxyz = quat_wxyz(T_base_link[:3, :3])
            self._root.visible = True

    def highlight(self, chosen: Collection[str], colliding: Collection[str] = ()) -> None:
        """Colour the chosen links apart from the rest, and those that would collide apart from both."""
        for (link, material), mesh in self._meshes.items():
            color = shaded(COLLIDING if link in colliding else CHOSEN if link in chosen else self._color, material)
            if tuple(mesh.color) != color:
                mesh.color = color

    def hide(self) -> None:
        self._root.visible = False

    def remove(self) -> None:
        """Take it away, with everything that was drawn onto its links."""
        self._drawn.clear()


def shaded(color: tuple[int, int, int], material: str) -> tuple[int, int, int]:
    """A link's colour on a part of that material."""
    if material == MARK and color == BODY:
        return ARROW
    red, green, blue = (round(SHADES[material] * one) for one in color)
    return red, green, blue


def leg_links(robot: Robot, leg: int) -> set[str]:
    """Names of the links of one leg that have a shape."""
    return {link for link in robot.description.meshes if link.startswith(f"leg{leg}_")}
