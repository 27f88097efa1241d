"""Where the scene is looked at from: presets, and a view that goes along with chassis or wheel."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from footfall.core.arrays import Array
from footfall.core.frames import apply, rotation
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall_ui.scene.drawn import server_of

ABOVE = 9.0
"""Of the view from the top, over the chassis [m]."""
BEHIND, OVER = 0.4, 1.8
"""Of the view along the leg, from its hip [m]: so high that the chassis does not hide the wheel."""
BESIDE, LOW, ASIDE = 1.7, 0.5, 0.9
"""Of the view of the wheel, from its centre [m], and from the leg's direction [rad]: the leg would hide the ground."""
MOVED = 0.005
"""A view goes along when what it follows has moved by more [m]."""


@dataclass(frozen=True)
class Eye:
    """position, target: site frame, (3,) [m]."""

    position: Array
    target: Array


def eye_of(look: str, robot: Robot, state: RobotState, leg: int) -> Eye | None:
    """Of a preset (footfall.session.view.LOOKS); None where the look leaves the view as it is."""
    T, up = state.T_site_base, np.array([0.0, 0.0, 1.0])
    wheel = apply(T, wheel_centers(robot, state.posture))[leg]
    T_site_hip = T @ robot.description.legs[leg].T_base_hip
    out = T_site_hip[:3, 0] * [1.0, 1.0, 0.0]
    out /= np.linalg.norm(out)
    if look == "top":
        # a little aside: straight down, no side of the picture would be up
        return Eye(T[:3, 3] + ABOVE * up - 0.01 * out, T[:3, 3])
    if look == "leg":
        return Eye(T_site_hip[:3, 3] - BEHIND * out + OVER * up, wheel)
    if look == "wheel":
        return Eye(wheel + BESIDE * rotation("z", ASIDE)[:3, :3] @ out + LOW * up, wheel)
    return None


def followed(look: str, robot: Robot, state: RobotState, leg: int) -> Array | None:
    """The point that a look goes along with, site frame (3,) [m]; None where it stays."""
    if look == "wheel":
        return apply(state.T_site_base, wheel_centers(robot, state.posture))[leg]
    return state.T_site_base[:3, 3] if look == "follow" else None


class Looking:
    """Turns the view of a page, or of every page of a server. What the operator turned by hand stays turned while the
    view goes along."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._asked = 0
        self._at: Array | None = None

    def look(self, look: str, asked: int, robot: Robot, state: RobotState, leg: int) -> None:
        """asked: how often a look was asked for; each time it is taken anew."""
        point = followed(look, robot, state, leg)
        if asked != self._asked:
            self._asked, self._at = asked, point
            eye = eye_of(look, robot, state, leg)
            if eye is not None:
                self._in_loop(lambda camera: _put(camera, eye.position, eye.target))
        elif point is not None and self._at is not None and np.linalg.norm(point - self._at) > MOVED:
            along = point - self._at
            self._at = point
            self._in_loop(lambda camera: _put(camera, camera.position + along, camera.look_at + along))

    def forget(self, asked: int) -> None:
        """Another session is shown, whose looks were taken already."""
        self._asked, self._at = asked, None

    def begin(self, eye: Eye) -> None:
        """Where a page that opens looks from."""
        if isinstance(self._server, viser.ViserServer):
            self._server.initial_camera.position = eye.position
            self._server.initial_camera.look_at = eye.target
        else:
            self._in_loop(lambda camera: _put(camera, eye.position, eye.target))

    def _in_loop(self, turn: Callable[[viser.CameraHandle], None]) -> None:
        """A page's camera belongs to viser's loop."""

        drawn = self._server

        def every() -> None:
            pages = [drawn] if isinstance(drawn, viser.ClientHandle) else drawn.get_clients().values()
            for page in pages:
                turn(page.camera)

        server_of(drawn).get_event_loop().call_soon_threadsafe(every)


def _put(camera: viser.CameraHandle, position: Array, target: Array) -> None:
    # in this order: a new position takes the target along
    camera.position = position
    camera.look_at = target
