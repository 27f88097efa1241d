"""The one place that arranges labels: each hangs at its point by the corner at which it covers least of the others.

Points of labels are fixed, of their eight places about the point one is chosen (E. Imhof, Positioning Names on Maps,
1975), label after label until none is better off elsewhere (J. Christensen, J. Marks, S. Shieber, An Empirical Study
of Algorithms for Point-Feature Label Placement, 1995, discrete gradient descent). Numbers of footfalls and letters of
the compass that would still cover something are left out until the view is nearer; their marks stay. Where pages see
the same scene, labels are arranged for the one whose view was turned last.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal
from weakref import WeakKeyDictionary

import numpy as np
import viser

from footfall.core.arrays import Array
from footfall.core.frames import rotation_from_quat_wxyz

Anchor = Literal[
    "top-left", "top-center", "top-right", "center-left", "center-right", "bottom-left", "bottom-center", "bottom-right"
]

ANCHORS: dict[Anchor, tuple[float, float]] = {
    "bottom-left": (0.0, -1.0),
    "top-left": (0.0, 0.0),
    "bottom-right": (-1.0, -1.0),
    "top-right": (-1.0, 0.0),
    "bottom-center": (-0.5, -1.0),
    "top-center": (-0.5, 0.0),
    "center-left": (0.0, -0.5),
    "center-right": (-1.0, -0.5),
}
"""What of a label is at its point → its left and top edge from there, shares of width and height; the best first."""
FIRST: Anchor = "bottom-left"
"""Of a label that was not arranged yet."""
CHARACTER, HEIGHT, GAP = 6.5, 17.0, 4.0
"""Mean width of a character, height of a label with its rim, and what is left free around it [px]."""
YIELDING = ("/walk/", "/suggested/", "/bearings/")
"""How names of labels begin that may be left out; an end and its reason may not."""
STAYING = ("/walk/end",)
SWEEPS = 4
"""So often every label may move."""


@dataclass(frozen=True)
class Page:
    """How a page looks at the scene. T_site_camera: (4, 4), OpenCV axes; fov: vertical [rad]; width, height [px].

    Labels are as large in the page's pixels on every screen; viser's picture may have fewer or more of them.
    """

    T_site_camera: Array
    fov: float
    width: float
    height: float

    def pixels(self, points: Array) -> Array:
        """Where points (n, 3), site frame [m], are seen, (n, 2) [px] from the top left; NaN behind the camera."""
        seen = (points - self.T_site_camera[:3, 3]) @ self.T_site_camera[:3, :3]
        depth = np.where(seen[:, 2] > 0, seen[:, 2], np.nan)[:, None]
        focal = self.height / (2 * np.tan(self.fov / 2))
        return 0.5 * np.array([self.width, self.height]) + focal * seen[:, :2] / depth


def sizes_of(texts: Sequence[str]) -> Array:
    """What labels cover, (n, 2), width and height [px]."""
    return np.array([(CHARACTER * len(text) + 2 * GAP, HEIGHT + GAP) for text in texts]).reshape(-1, 2)


def boxes(points: Array, sizes: Array, anchors: Sequence[Anchor]) -> Array:
    """Left, top, right and bottom of labels, (n, 4) [px]."""
    corner = points + sizes * np.array([ANCHORS[one] for one in anchors]).reshape(-1, 2)
    return np.hstack([corner, corner + sizes])


def covered(box: Array, others: Array) -> float:
    """Area that a box (4,) shares with others (n, 4), in all [px²]."""
    both = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    return float(np.prod(np.clip(both, 0.0, None), axis=1).sum())


def arranged(points: Array, sizes: Array, now: Sequence[Anchor]) -> list[Anchor]:
    """Anchors with which labels at points (n, 2) [px] cover no more of each other than now, and as little as can be
    had by moving one after the other. What covers nothing stays as it is.
    """
    anchors = list(now)
    placed = boxes(points, sizes, anchors)
    for _ in range(SWEEPS):
        moved = False
        for i in range(len(anchors)):
            others = np.delete(placed, i, axis=0)
            least = covered(placed[i], others)
            for anchor in ANCHORS:
                if least == 0:
                    break
                box = boxes(points[i : i + 1], sizes[i : i + 1], [anchor])[0]
                if covered(box, others) < least:
                    least, anchors[i], placed[i], moved = covered(box, others), anchor, box, True
        if not moved:
            break
    return anchors


def shown_of(placed: Array, yielding: Sequence[bool]) -> list[bool]:
    """Which labels are shown, of their boxes (n, 4): of those that may be left out, one after the other, each that
    covers none that is shown.
    """
    shown = ~np.array(yielding, bool)
    for i in np.flatnonzero(~shown):
        shown[i] = covered(placed[i], placed[shown]) == 0
    return shown.tolist()


def may_yield(name: str) -> bool:
    """Whether a label may be left out where there is no room."""
    return name.startswith(YIELDING) and name not in STAYING


class Labels:
    """All labels of a scene that stand in the site by themselves."""

    def __init__(self) -> None:
        self._handles: dict[str, viser.LabelHandle] = {}
        self._anchors: dict[str, Anchor] = {}
        self._page: Page | None = None
        self._size_of_page: Callable[[], tuple[float, float] | None] = lambda: None

    def add(self, handle: viser.LabelHandle) -> None:
        """One that is drawn. Labels on the rover go with it, and stay as they are."""
        if not handle.name.startswith("/rover/"):
            self._handles[handle.name] = handle
            handle.anchor = self._anchors.get(handle.name, FIRST)

    def seen_from(self, camera: viser.CameraHandle) -> None:
        """A page's view was turned."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotation_from_quat_wxyz(camera.wxyz), camera.position
        self._page = Page(T, camera.fov, camera.image_width, camera.image_height)

    def follow(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        turned: Callable[[], None],
        size_of_page: Callable[[], tuple[float, float] | None] = lambda: None,
    ) -> None:
        """Hear of a page's view, or of every page's of a server; ``turned`` is called whenever one was.

        size_of_page: width and height in its own pixels, None where it has not said so: then viser's are taken.
        """
        self._size_of_page = size_of_page

        def heard(camera: viser.CameraHandle) -> None:
            self.seen_from(camera)
            turned()

        def meet(client: viser.ClientHandle) -> None:
            client.camera.on_update(heard)

        if isinstance(server, viser.ViserServer):
            server.on_client_connect(meet)
        else:
            meet(server)

    def arrange(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        """For the page whose view was turned last; those that were taken away are forgotten."""
        there = server.scene.get_handle_by_name
        self._handles = {name: one for name, one in self._handles.items() if there(name) is one}
        if self._page is None or not self._handles:
            return
        shown = list(self._handles.values())
        size = self._size_of_page()
        page = self._page if size is None else replace(self._page, width=size[0], height=size[1])
        points = page.pixels(np.array([one.position for one in shown]))
        seen = [(one, point) for one, point in zip(shown, points, strict=True) if np.isfinite(point).all()]
        handles, places = [one for one, _ in seen], np.array([point for _, point in seen]).reshape(-1, 2)
        now: list[Anchor] = [self._anchors.get(one.name, FIRST) for one in handles]
        sizes = sizes_of([one.text for one in handles])
        anchors = arranged(places, sizes, now)
        seen_now = shown_of(boxes(places, sizes, anchors), [may_yield(one.name) for one in handles])
        for handle, anchor, visible in zip(handles, anchors, seen_now, strict=True):
            self._anchors[handle.name] = anchor
            if handle.anchor != anchor:
                handle.anchor = anchor
            handle.visible = visible


_of_scene: WeakKeyDictionary[viser.ViserServer | viser.ClientHandle, Labels] = WeakKeyDictionary()


def labels_of(server: viser.ViserServer | viser.ClientHandle) -> Labels:
    """Those of that scene, whoever draws them."""
    return _of_scene.setdefault(server, Labels())
