"""Where the scene is looked at from: presets, and a view that goes along with chassis or foot."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from footfall.core.arrays import Array
from footfall.core.frames import apply, rotation
from footfall.robot.foot_centers import soles
from footfall.telemetry.state import RobotState
from footfall_ui.scene.any_robot import AnyRobot, hip, lowest, outward, size
from footfall_ui.scene.drawn import server_of

ABOVE = 9.0
"""Of the view from the top, over the chassis [m]; as the lengths below it is that of ATHLETE."""
BEHIND, OVER = 0.4, 1.8
"""Of the view along the leg, from its hip [m]: so high that the chassis does not hide the wheel."""
BESIDE, LOW, ASIDE = 1.7, 0.5, 0.9
"""Of the view of the wheel, from its centre [m], and from the leg's direction [rad]: the leg would hide the ground."""
VIEW_DISTANCE, VIEW_HEIGHT = 6.2, 3.4
"""Of the first view from the middle of the rover, and from the ground under it [m]."""
VIEW_ASIDE = 0.7
"""Angle between the first view and the leg [rad]."""
MOVED = 0.005
"""A view goes along when what it follows has moved by more [m], of ATHLETE."""
TURNED = 0.02
"""A view is no longer that of a preset when it was turned by hand by more [m], of ATHLETE."""


@dataclass(frozen=True)
class Eye:
    """position, target: site frame, (3,) [m]."""

    position: Array
    target: Array


def eye_of(look: str, robot: AnyRobot, state: RobotState, leg: int) -> Eye | None:
    """Of a preset (footfall.session.view.LOOKS); None where the look leaves the view as it is."""
    T, up = state.T_site_base, np.array([0.0, 0.0, 1.0])
    foot = apply(T, soles(robot, state.posture))[leg]
    out = T[:3, :3] @ outward(robot, leg, state.posture) * [1.0, 1.0, 0.0]
    out /= np.linalg.norm(out)
    large = size(robot)
    if look == "top":
        # a little aside: straight down, no side of the picture would be up
        return Eye(T[:3, 3] + large * (ABOVE * up - 0.01 * out), T[:3, 3])
    if look == "leg":
        return Eye(apply(T, hip(robot, state.posture, leg)) + large * (OVER * up - BEHIND * out), foot)
    if look == "wheel":
        return Eye(foot + large * (BESIDE * rotation("z", ASIDE)[:3, :3] @ out + LOW * up), foot)
    return None


def first_eye(robot: AnyRobot, leg: int, state: RobotState | None = None) -> Eye:
    """Where a page that opens looks from: outside the leg that is worked with, a little to its side.

    state: where the rover is; None: at the site's origin, on ground of height 0.
    """
    out, under, large = outward(robot, leg), np.zeros(3), size(robot)
    if state is not None:
        T = state.T_site_base
        out = T[:3, :3] @ outward(robot, leg, state.posture) * [1.0, 1.0, 0.0]
        out /= np.linalg.norm(out)
        feet = [lowest(robot, state.posture, one, T)[2] for one in robot.legs]
        under = np.array([T[0, 3], T[1, 3], min(feet)])
    away = large * VIEW_DISTANCE * (rotation("z", VIEW_ASIDE)[:3, :3] @ out) * [1.0, 1.0, 0.0]
    return Eye(under + away + [0.0, 0.0, large * VIEW_HEIGHT], under + 0.15 * away + [0.0, 0.0, large * 0.4])


def followed(look: str, robot: AnyRobot, state: RobotState, leg: int) -> Array | None:
    """The point that a look goes along with, site frame (3,) [m]; None where it stays."""
    if look == "wheel":
        return apply(state.T_site_base, soles(robot, state.posture))[leg]
    return state.T_site_base[:3, 3] if look == "follow" else None


class Preset:
    """A preset that a page was turned to. Views that it still tells from before it got there do not leave it."""

    def __init__(self, eye: Eye, near: float) -> None:
        self._eye, self._near = eye, near
        self._reached = False

    def take(self, camera: viser.CameraHandle) -> None:
        """Turn a page there; one that is there already will not say so again."""
        if camera.update_timestamp:
            self.is_left_by(camera)
        _put(camera, self._eye.position, self._eye.target)

    def is_left_by(self, camera: viser.CameraHandle) -> bool:
        """Whether the page was there and no longer is."""
        off = max(
            np.linalg.norm(camera.position - self._eye.position), np.linalg.norm(camera.look_at - self._eye.target)
        )
        if off <= self._near:
            self._reached = True
        return self._reached and bool(off > self._near)


class Looking:
    """Turns the view of a page, or of every page of a server. What the operator turned by hand stays turned while the
    view goes along."""

    def __init__(
        self, server: viser.ViserServer | viser.ClientHandle, turned: Callable[[], None] = lambda: None
    ) -> None:
        """turned: called when a page's operator has turned its view away from a preset that stays."""
        self._server, self._turned = server, turned
        self._asked = 0
        self._at: Array | None = None
        self._preset: Preset | None = None
        if isinstance(server, viser.ClientHandle):
            server.camera.on_update(self._heard)

    def look(self, look: str, asked: int, robot: AnyRobot, state: RobotState, leg: int) -> None:
        """asked: how often a look was asked for; each time it is taken anew."""
        point = followed(look, robot, state, leg)
        if asked != self._asked:
            self._asked, self._at = asked, point
            self._preset = None
            eye = eye_of(look, robot, state, leg)
            if eye is not None:
                preset = Preset(eye, TURNED * size(robot))
                if point is None:
                    self._preset = preset
                self._in_loop(preset.take)
        elif point is not None and self._at is not None and np.linalg.norm(point - self._at) > MOVED * size(robot):
            along = point - self._at
            self._at = point
            self._in_loop(lambda camera: _put(camera, camera.position + along, camera.look_at + along))

    def forget(self, asked: int) -> None:
        """Another session is shown, whose looks were taken already."""
        self._asked, self._at, self._preset = asked, None, None

    def begin(self, eye: Eye) -> None:
        """Where a page that opens looks from."""
        if isinstance(self._server, viser.ViserServer):
            self._server.initial_camera.position = eye.position
            self._server.initial_camera.look_at = eye.target
        else:
            self._in_loop(lambda camera: _put(camera, eye.position, eye.target))

    def _heard(self, camera: viser.CameraHandle) -> None:
        preset = self._preset
        if preset is not None and preset.is_left_by(camera):
            self._preset = None
            self._turned()

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
