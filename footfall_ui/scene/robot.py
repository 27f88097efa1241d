"""The rover: one batch of meshes for links that are built alike, moved in place; and see-through copies of it."""

from collections.abc import Collection, Mapping

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import quat_wxyz
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.display import Part, display_parts
from footfall.robot.model import Robot
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import HERE
from footfall_ui.scene.painted import Color, drawn_mesh, painted_glb

BODY = (226, 228, 232)
CHOSEN = (120, 190, 255)
GHOST = (250, 214, 80)
COLLIDING = (255, 60, 150)
LEVELS = ((10.0, 0.4), (25.0, 0.15))
"""From that distance of the camera on [m], that share of a link's triangles is drawn."""


class RobotDrawing:
    """Draws every link of a robot under ``/<name>``; ``links`` limits it to some of them.

    The rover itself has the materials of its parts; a copy in a colour of its own is see-through and of one tone.
    """

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        robot: Robot,
        name: str = "rover",
        links: set[str] | None = None,
        color: Color | None = None,
        opacity: float | None = None,
    ) -> None:
        self._robot = robot
        self._server = server
        self._drawn = Drawn(server)
        self._root = self._drawn.add(server.scene.add_frame, f"/{name}", show_axes=False, visible=False)
        alike: dict[tuple[Part, ...], list[str]] = {}
        for link, parts in display_parts(robot.description).items():
            if links is None or link in links:
                alike.setdefault(parts, []).append(link)
        self._groups = [_Alike(server, name, links, parts, color, opacity) for parts, links in alike.items()]

    def place(self, posture: NDArray[np.float64], T_site_base: NDArray[np.float64]) -> None:
        """Move all links to a posture (legs × 6,) [rad] and a chassis pose."""
        with self._server.atomic():
            self._root.position = T_site_base[:3, 3]
            self._root.wxyz = quat_wxyz(T_site_base[:3, :3])
            poses = link_poses(self._robot, posture)
            for group in self._groups:
                group.place(poses)
            self._root.visible = True

    def highlight(self, chosen: Collection[str], colliding: Collection[str] = ()) -> None:
        """Colour the chosen links apart from the rest, and those that would collide apart from both."""
        with self._server.atomic():
            for group in self._groups:
                group.color(
                    {
                        link: COLLIDING if link in colliding else CHOSEN if link in chosen else None
                        for link in group.links
                    }
                )

    def hide(self) -> None:
        self._root.visible = False

    def remove(self) -> None:
        """Take it away, with everything that was drawn onto it."""
        self._drawn.clear()


class _Alike:
    """Links of the same parts: a batch of them in each colour, those that no link has hidden."""

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        name: str,
        links: list[str],
        parts: tuple[Part, ...],
        color: Color | None,
        opacity: float | None,
    ) -> None:
        self.links = links
        self._server, self._parts, self._color, self._opacity = server, parts, color, opacity
        self._name = f"/{name}/{links[0].split('_', 1)[-1]}"
        self._of: dict[str, Color | None] = dict.fromkeys(links, color)
        self._places = {link: (np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)) for link in links}
        self._batches = {color: self._made(color)}

    def place(self, Ts_base_link: Mapping[str, NDArray[np.float64]]) -> None:
        """Of the robot's links; those that have not moved are not sent."""
        self._places = {
            link: (quat_wxyz(Ts_base_link[link][:3, :3]), Ts_base_link[link][:3, 3].copy()) for link in self.links
        }
        self._put()

    def color(self, of: dict[str, Color | None]) -> None:
        """Link → its colour, None: that of its materials."""
        if of == self._of:
            return
        self._of = of
        for color in set(of.values()) - set(self._batches):
            self._batches[color] = self._made(color)
        self._put()

    def _made(self, color: Color | None) -> viser.BatchedGlbHandle | viser.BatchedMeshHandle:
        """As large as it may become: viser makes room for as many as there are at first."""
        wxyzs, positions = self._arrays(self.links)
        name = self._name if color == self._color else f"{self._name}-{'-'.join(map(str, color or ()))}"
        scene = self._server.scene
        if self._opacity is None:
            content = painted_glb(self._parts, color)
            return scene.add_batched_glb(
                name, content, wxyzs, positions, position=HERE, lod=LEVELS, cast_shadow=False, receive_shadow=False
            )
        mesh, _ = drawn_mesh(self._parts)
        return scene.add_batched_meshes_simple(
            name,
            mesh.vertices.astype(np.float32),
            mesh.triangles.astype(np.uint32),
            wxyzs,
            positions,
            position=HERE,
            batched_colors=color or BODY,
            opacity=self._opacity,
            lod=LEVELS,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _arrays(self, links: list[str]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        quaternions, positions = zip(*(self._places[link] for link in links), strict=True)
        return np.array(quaternions, np.float32), np.array(positions, np.float32)

    def _put(self) -> None:
        for color, batch in self._batches.items():
            links = [link for link in self.links if self._of[link] == color]
            batch.visible = bool(links)
            if links:
                batch.batched_wxyzs, batch.batched_positions = self._arrays(links)


def leg_links(robot: Robot, leg: int) -> set[str]:
    """Names of the links of one leg that have a shape."""
    return {link for link in robot.description.meshes if link.startswith(f"leg{leg}_")}
