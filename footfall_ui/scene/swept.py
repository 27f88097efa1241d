"""What the leg, or the rover, passes through on its planned way: a few see-through samples of it."""

from collections.abc import Mapping

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import quat_wxyz
from footfall.planning.between_rows import at
from footfall.planning.motion import Motion
from footfall_ui.scene.any_robot import AnyRobot, Ts_base_part, part_meshes
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.robot import GHOST

SAMPLES = 9


def swept_poses(robot: AnyRobot, motion: Motion, count: int = SAMPLES) -> Mapping[str, NDArray[np.float64]]:
    """Ts_site_link (count, 4, 4) of every link that moves, evenly along the motion from its start to its end."""
    links = part_meshes(robot, motion.leg)
    placed = []
    for moment in np.linspace(0.0, 1.0, count):
        posture, T_site_base = at(motion, float(moment))
        placed.append({link: T_site_base @ T for link, T in Ts_base_part(robot, posture).items() if link in links})
    return {link: np.array([one[link] for one in placed]) for link in sorted(links)}


class SweptDrawing:
    """One batch of see-through copies for each link."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of = ""

    def show(self, robot: AnyRobot, motion: Motion, digest: str) -> None:
        """digest: names the motion; the same one is not drawn again."""
        if self._of == digest:
            return
        self._of = ""
        names, meshes = [], part_meshes(robot, motion.leg)
        for link, Ts in swept_poses(robot, motion).items():
            mesh = meshes[link]
            names.append(f"/swept/{link}")
            places, middle = near(Ts[:, :3, 3])
            self._drawn.add(
                self._server.scene.add_batched_meshes_simple,
                names[-1],
                mesh.vertices.astype(np.float32),
                mesh.triangles.astype(np.uint32),
                np.array([quat_wxyz(T[:3, :3]) for T in Ts]),
                places,
                batched_colors=GHOST,
                opacity=0.12,
                flat_shading=True,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
                position=middle,
            )
        self._drawn.only(names)
        self._of = digest

    def hide(self) -> None:
        self._of = ""
        self._drawn.clear()
