"""Between images and ground: which point of it a pixel shows, and where plan, footfall and grid lie in an image."""

from typing import Annotated, Any, Literal, TypedDict

import numpy as np
from fastapi import Query
from numpy.typing import NDArray

from footfall.api.access import OneSession, product
from footfall.api.routes.image_views import Views
from footfall.api.routes.images import PairName, Side, SnapshotName, pair_of
from footfall.api.routing import Routes
from footfall.core import frames
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.planning.legged.problem import LeggedResult
from footfall.planning.step.problem import PlanResult
from footfall.session.answers.notes import DigestText
from footfall.session.live import LiveSession
from footfall.session.products.image_views import ImageViews
from footfall.session.products.kinds import DESCRIBED_STEP, PLAN
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.projection import in_image, sight
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import pick

router = Routes(tags=["images"])

REACH = 10.0
"""The grid is drawn this far around the camera [m]."""

Pixel = Annotated[float, Query(description="[px]; the centre of the first pixel is 0", ge=-0.5, le=8192)]
Spacing = Annotated[float, Query(description="distance of the grid's lines [m]", ge=0.1, le=10.0)]
Polyline = Annotated[Array, "pixels (n, 2), u to the right and v down"]


class ImagePoint(TypedDict):
    """What a pixel shows. point: of the ground, site frame [m]; null where it shows none, and the reason says why."""

    point: Array | None
    reason: str


class Stretch(TypedDict):
    """Part of the planned way of the centre of wheel or sole."""

    phase: str
    line: Polyline


class FootfallInImage(TypedDict):
    """The chosen footfall. at: its pixel, null outside. ring: of the radius of wheel or sole, what is seen of it.

    seen_by: the pairs of the snapshot in whose images, of this side, it is in sight.
    """

    leg: int
    seen: Literal["in sight", "hidden", "outside"]
    seen_by: list[str]
    at: Array | None
    ring: list[Polyline]
    normal: list[Polyline]


class OverlayAnswer(TypedDict):
    """What is to be seen of plan, footfall and grid in one image; what nearer ground hides is left out.

    path: the way of wheel or sole in the present plan of a step. waypoints, through: pixels (n, 2) of the plan's
    waypoints (of a robot that others described, of the ends of its phases), and of the points that it was led through.
    grid: lines on the ground every ``spacing`` [m], but where the rover is before them.
    """

    snapshot: DigestText
    pair: str
    side: str
    width: int
    height: int
    dem: DigestText | None
    plan: DigestText | None
    path: list[Stretch]
    waypoints: Array
    through: Array
    footfall: FootfallInImage | None
    spacing: float
    grid: list[Polyline]


@router.get("/sessions/{session}/images/{pair}/{side}/at")
def read_pixel(
    live: OneSession, views: Views, pair: PairName, side: Side, u: Pixel, v: Pixel, of: SnapshotName = "current"
) -> ImagePoint:
    """Which point of the terrain a pixel shows."""
    snapshot, found = pair_of(live, of, pair)
    camera = _camera(found, side)
    if not in_image(camera, np.array([u, v])):
        raise InvalidInput(f"the image has {camera.width} × {camera.height} pixels", u=u, v=v)
    if live.state.dem is None:
        return _no_ground("there is no terrain yet: build it from the images, or load one")
    row, col = min(round(v), camera.height - 1), min(round(u), camera.width - 1)
    if views.silhouette(live, snapshot, camera)[max(row, 0), max(col, 0)]:
        return _no_ground("this is the rover itself, not ground")
    dem = product(live, live.state.dem, Dem)
    T = _pose(found, camera, dem)
    point = pick(dem, T[:3, 3], T[:3, :3] @ sight(camera, u, v))
    if point is None:
        return _no_ground("no ground there: the line of sight meets none that is known and on the map")
    return {"point": point, "reason": ""}


def _camera(pair: ImagePair, side: str) -> Camera:
    return pair.camera_left if side == "left" else pair.camera_right


def _no_ground(reason: str) -> ImagePoint:
    return {"point": None, "reason": reason}


def _pose(pair: ImagePair, camera: Camera, dem: Dem) -> NDArray[np.float64]:
    """T_site_camera when the images were taken, as that pose is on the map."""
    T = pair.T_site_base @ camera.T_base_camera
    return T if dem.correction is None else dem.correction @ T


@router.get("/sessions/{session}/images/{pair}/{side}/overlay")
def overlay(
    live: OneSession,
    views: Views,
    pair: PairName,
    side: Side,
    spacing: Spacing = 0.5,
    of: SnapshotName = "current",
) -> OverlayAnswer:
    """The present plan and footfall, and a grid on the present terrain, as lines over one image."""
    from footfall.terrain.ground.drape import draped_grid
    from footfall.terrain.ground.image_lines import seen_lines

    snapshot, found = pair_of(live, of, pair)
    camera = _camera(found, side)
    state = live.state
    planned = state.newest(PLAN if live.described is None else DESCRIBED_STEP)
    answer: OverlayAnswer = {
        "snapshot": snapshot.digest,
        "pair": pair,
        "side": side,
        "width": camera.width,
        "height": camera.height,
        "dem": state.dem,
        "plan": planned,
        "path": [],
        "waypoints": np.zeros((0, 2)),
        "through": np.zeros((0, 2)),
        "footfall": None,
        "spacing": spacing,
        "grid": [],
    }
    if state.dem is None:
        return answer
    dem = product(live, state.dem, Dem)
    T = _pose(found, camera, dem)
    covered = views.silhouette(live, snapshot, camera)
    answer["grid"] = _rounded(seen_lines(dem, camera, T, draped_grid(dem, T[:2, 3], REACH, spacing), covered))
    if planned is not None:
        answer.update(_planned(live, planned, dem, camera, T))
    answer["footfall"] = _footfall(live, views, snapshot, found, side, dem)
    return answer


def _planned(live: LiveSession, digest: str, dem: Dem, camera: Camera, T: NDArray[np.float64]) -> Any:
    from footfall.terrain.ground.image_lines import seen, seen_lines

    way, through = _way(live, digest)
    if not way:
        return {}
    corners = np.array([way[0][1][0], *(points[-1] for _, points in way)])
    pixels, visible = seen(dem, camera, T, corners)
    led, led_visible = seen(dem, camera, T, through)
    return {
        "path": [
            {"phase": phase, "line": line}
            for phase, points in _joined(way)
            for line in _rounded(seen_lines(dem, camera, T, [points]))
        ],
        "waypoints": np.round(pixels[visible], 1),
        "through": np.round(led[led_visible], 1),
    }


def _way(live: LiveSession, digest: str) -> tuple[list[tuple[str, Array]], Array]:
    """Phases of a plan with points (n, 3) of the foot's centre, and the points (n, 3) that it was led through [m]."""
    from footfall.planning.legged.sole_way import sole_way
    from footfall.planning.step.wheel_way import wheel_way
    from footfall.robot.legged.legged_robot import LeggedRobot

    robot, none = live.any_robot, np.zeros((0, 3))
    if isinstance(robot, LeggedRobot):
        found = product(live, digest, LeggedResult)
        return ([] if found.plan is None else _joined(sole_way(robot, found.plan))), none
    result = product(live, digest, PlanResult)
    way = [] if result.plan is None else wheel_way(robot, result.plan)
    return way, np.array(result.through, float).reshape(-1, 3)


def _joined(way: list[tuple[str, NDArray[np.float64]]]) -> list[tuple[str, NDArray[np.float64]]]:
    """Stretches of one phase that follow each other as one."""
    joined: list[tuple[str, NDArray[np.float64]]] = []
    for phase, points in way:
        if joined and joined[-1][0] == phase:
            joined[-1] = phase, np.concatenate([joined[-1][1], points[1:]])
        else:
            joined.append((phase, points))
    return joined


def _footfall(
    live: LiveSession, views: ImageViews, snapshot: Snapshot, pair: ImagePair, side: str, dem: Dem
) -> FootfallInImage | None:
    from footfall.terrain.ground.image_lines import seen, seen_lines

    chosen = live.choices.now.footfall
    answer = None if chosen is None else live.maps.footfall_answer(chosen)
    if chosen is None or answer is None or not answer["known"]:
        return None
    R = frames.rotation_from_z(answer["normal"] or (0.0, 0.0, 1.0))
    point = np.array([answer["x"], answer["y"], answer["z"]])
    angle = np.linspace(0.0, 2 * np.pi, 49)
    circle = live.maps.sole_radius(chosen.leg) * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(49)])
    # lifted as in the scene: ground between two points of the ring is no hindrance
    ring, normal = point + circle @ R.T + 0.02 * R[:, 2], point + np.linspace(0.0, 0.5, 13)[:, None] * R[:, 2]

    def look(one: ImagePair) -> tuple[NDArray[np.float64], bool]:
        camera = _camera(one, side)
        covered = views.silhouette(live, snapshot, camera)
        pixels, visible = seen(dem, camera, _pose(one, camera, dem), point[None], covered)
        return pixels[0], bool(visible[0])

    camera, (pixel, in_sight) = _camera(pair, side), look(pair)
    T, inside = _pose(pair, camera, dem), bool(in_image(camera, pixel))
    return {
        "leg": answer["leg"],
        "seen": "in sight" if in_sight else "hidden" if inside else "outside",
        "seen_by": [one.name for one in snapshot.pairs if look(one)[1]],
        "at": np.round(pixel, 1) if inside else None,
        "ring": _rounded(seen_lines(dem, camera, T, [ring])),
        "normal": _rounded(seen_lines(dem, camera, T, [normal])),
    }


def _rounded(lines: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    return [np.round(line, 1) for line in lines]
