"""What is in hand, with a handle to drag it: the footfall over the ground, a point in space, the chassis turned too.

While it is dragged the session is told of the newest place, as fast as it can say what is to be said of it; letting go
commits it. Every page's scene has the same handle.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from footfall.core.arrays import Array
from footfall.core.frames import quat_wxyz, rotation_from_quat_wxyz, transform
from footfall.planning.body.body_shift import BodyShift
from footfall.session.answers.choices import What
from footfall.session.choosing.hand import Held
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.footfall import NO, OPEN, YES
from footfall_ui.scene.near import near

SIZES = {"footfall": 0.6, "point": 0.5, "chassis": 1.6}
"""Of the handles [m]."""
SIGNS = {True: "✓ ", False: "✕ ", None: ""}
ABOVE = 0.35
"""Of the words, over the handle [m]."""
NEAR = 1e-6
"""A handle that is nearer to its place stays as it is [m]."""


@dataclass(frozen=True)
class Drag:
    """Where a handle was dragged to. over: whether it was let go; client: number of viser's page."""

    what: What
    index: int
    T_site_handle: Array
    over: bool
    client: int | None


def pose_of(held: Held, dem: Dem, T_site_base: Array) -> Array:
    """T_site_handle (4, 4). T_site_base: of the chassis as the rover stands.

    A footfall's handle lies on the ground, at height 0 where that is not known.
    """
    if held.what == "chassis":
        return BodyShift(*held.place).applied(T_site_base)
    if held.what == "point":
        return transform(translation=held.place)
    x, y = held.place
    z = float(height_at(dem, x, y))
    return transform(translation=(x, y, z if np.isfinite(z) else 0.0))


def place_of(what: What, T_site_handle: Array, T_site_base: Array) -> tuple[float, ...]:
    """Inverse of :func:`pose_of`, as ``hold`` takes it. Raises InvalidInput where a chassis is dragged too far."""
    if what == "chassis":
        return tuple(BodyShift.between(T_site_base, T_site_handle).vector.tolist())
    return tuple(T_site_handle[: 2 if what == "footfall" else 3, 3].tolist())


class Drags:
    """Drags that wait to be told: of several places only the newest, letting go always. Used in viser's loop and one
    other thread."""

    def __init__(self, soon: Callable[[Callable[[], None]], None], tell: Callable[[Drag], None]) -> None:
        """soon: has something done in the thread that tells."""
        self._soon, self._tell = soon, tell
        self._waiting: deque[Drag] = deque()

    def put(self, drag: Drag) -> None:
        if self._waiting and not self._waiting[-1].over:
            self._waiting[-1] = drag
        else:
            self._waiting.append(drag)
        self._soon(self._next)

    def _next(self) -> None:
        if self._waiting:
            self._tell(self._waiting.popleft())


class HandleDrawing:
    """One handle, a ring where a footfall would be, and what is told there."""

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        soon: Callable[[Callable[[], None]], None],
        dragged: Callable[[Drag], None],
    ) -> None:
        """dragged: called through ``soon`` with where the handle was dragged to."""
        self._server = server
        self._drawn = Drawn(server)
        self._drags = Drags(soon, dragged)
        self._handle: viser.TransformControlsHandle | None = None
        self._of: tuple[str, int] | None = None
        self._under_way = False

    def show(self, held: Held, dem: Dem, T_site_base: Array, radius: float) -> None:
        """T_site_base: of the chassis as the rover stands; radius: of the foot that a footfall is for [m]."""
        T = pose_of(held, dem, T_site_base)
        if self._handle is None or self._of != (held.what, held.index):
            self.hide()
            self._handle = self._made(held, T)
            self._of = held.what, held.index
        elif not self._under_way and np.abs(T - _pose(self._handle)).max() > NEAR:
            self._handle.position = T[:3, 3]
            self._handle.wxyz = quat_wxyz(T[:3, :3])
        good = held.read["good"]
        over = T[:3, 3] + [0.0, 0.0, ABOVE]
        scene, names = self._server.scene, ["/hand/handle", "/hand/text"]
        self._drawn.add(scene.add_label, "/hand/text", f"{SIGNS[good]}{held.read['brief']}", position=over)
        if held.what == "footfall":
            color = OPEN if good is None else YES if good else NO
            ring, middle = near(_ring(dem, T[:3, 3], radius))
            self._drawn.add(
                scene.add_line_segments,
                "/hand/ring",
                ring,
                color,
                thickness=3.0,
                thickness_units="screen",
                position=middle,
            )
            names.append("/hand/ring")
        self._drawn.only(names)

    def hide(self) -> None:
        self._handle, self._of, self._under_way = None, None, False
        self._drawn.clear()

    def _made(self, held: Held, T: Array) -> viser.TransformControlsHandle:
        handle = self._drawn.add(
            self._server.scene.add_transform_controls,
            "/hand/handle",
            SIZES[held.what],
            active_axes=(True, True, held.what != "footfall"),
            disable_rotations=held.what != "chassis",
            depth_test=False,
            position=T[:3, 3],
            wxyz=quat_wxyz(T[:3, :3]),
        )
        what, index = held.what, held.index

        async def moved(event: viser.TransformControlsEvent) -> None:
            # in viser's loop, so in their order
            self._under_way = event.phase != "end"
            if event.phase != "start":
                self._drags.put(Drag(what, index, _pose(event.target), event.phase == "end", event.client_id))

        handle.on_update(moved)
        return handle


def _pose(handle: viser.TransformControlsHandle) -> Array:
    return transform(rotation_from_quat_wxyz(handle.wxyz), handle.position)


def _ring(dem: Dem, point: Array, radius: float) -> Array:
    """Segments (32, 2, 3) of a circle on the ground around a point; over unknown ground at the point's height."""
    angle = np.linspace(0, 2 * np.pi, 33)
    x, y = point[0] + radius * np.cos(angle), point[1] + radius * np.sin(angle)
    heights = height_at(dem, x, y)
    ring = np.column_stack([x, y, np.where(np.isfinite(heights), heights, point[2]) + 0.03])
    return np.stack([ring[:-1], ring[1:]], axis=1)
