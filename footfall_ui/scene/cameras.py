"""What the rover's cameras see: a frustum for the left one of each pair; the right one is beside it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.frames import quat_wxyz
from footfall.robot.description import CameraPairSpec
from footfall_ui.scene.any_robot import AnyRobot, size
from footfall_ui.scene.drawn import Drawn

SIZE = 0.5
"""Of a frustum beside ATHLETE [m]."""
COLOR = (255, 140, 220)


@dataclass(frozen=True)
class Frustum:
    """T_base_camera: OpenCV axes, (4, 4); fov: vertical field of view [rad]; aspect: width over height."""

    name: str
    T_base_camera: NDArray[np.float64]
    fov: float
    aspect: float


def frusta(pairs: Sequence[CameraPairSpec]) -> tuple[Frustum, ...]:
    """One for each camera pair."""
    cameras = [(pair.name, pair.camera_left) for pair in pairs]
    return tuple(
        Frustum(name, one.T_base_camera, 2 * float(np.arctan(one.height / (2 * one.fy))), one.width / one.height)
        for name, one in cameras
    )


class CamerasDrawing:
    """Frusta and names on a drawn rover, which carries them along; they go with it."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle, robot: AnyRobot, name: str = "rover") -> None:
        self._server, self._frusta, self._root = server, frusta(robot.description.cameras), f"/{name}/cameras"
        self._scale = SIZE * size(robot)
        self._drawn = Drawn(server)
        self._shown = False

    def show(self) -> None:
        if self._shown:
            return
        scene = self._server.scene
        for one in self._frusta:
            place, turn = one.T_base_camera[:3, 3], quat_wxyz(one.T_base_camera[:3, :3])
            self._drawn.add(scene.add_label, f"{self._root}/{one.name}/text", one.name, position=place)
            self._drawn.add(
                scene.add_camera_frustum,
                f"{self._root}/{one.name}/field",
                one.fov,
                one.aspect,
                scale=self._scale,
                color=COLOR,
                thickness=2.0,
                thickness_units="screen",
                cast_shadow=False,
                position=place,
                wxyz=turn,
            )
        self._shown = True

    def hide(self) -> None:
        self._shown = False
        self._drawn.clear()
