"""Images: asked of the rover, uploaded, and read back as PNG."""

from typing import Annotated, Literal, TypedDict

import numpy as np
from fastapi import Path, Query, Request, Response
from pydantic import Field

from footfall.api.access import AllSessions, OneSession, client_of, product, session_path
from footfall.api.bodies.answers import Digested, Url
from footfall.api.bodies.schemas import Calibration, CameraModel, ImageRequest
from footfall.api.door.in_turn import in_turn
from footfall.api.door.multipart import Uploaded, form_of, json_of, multipart_doc, upload_of
from footfall.api.routing import Routes, files
from footfall.core.errors import Conflict, NotFound
from footfall.io.image_files import MAX_PIXELS, claimed_pixels, decode_image, encode_png
from footfall.session.answers.notes import DigestText
from footfall.session.answers.sessions import SinceThen
from footfall.session.live import LiveSession
from footfall.session.pixels import HeldPixels
from footfall.session.products.snapshot_age import moved_since, taken_at
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall.telemetry.state import RobotState

router = Routes(tags=["images"])

PairName = Annotated[str, Path(description="name of a camera pair", max_length=100)]
Side = Annotated[Literal["left", "right"], Path(description="which camera of the pair")]
SnapshotName = Annotated[str, Query(description="digest of a snapshot", max_length=64, pattern="^[A-Za-z0-9]+$")]


class PairAnswer(TypedDict):
    """One stereo pair; baseline [m]."""

    name: str
    time: float
    width: int
    height: int
    baseline: float
    left: Url
    right: Url


class SnapshotAnswer(TypedDict):
    """The pairs that were taken together; taken: when they reached the server [s since 1970]."""

    snapshot: DigestText | None
    pairs: list[PairAnswer]
    taken: float | None
    since: SinceThen | None
    left_out: Annotated[dict[str, str], Field(description="pair that came, but can't be used → why")]


class ImagesAsked(TypedDict):
    """Names of the pairs that were asked for, null for all."""

    requested: list[str] | None


@router.get("/sessions/{session}/images")
def list_images(live: OneSession) -> SnapshotAnswer:
    """The pairs of the session's newest snapshot."""
    if live.state.snapshot is None:
        return {"snapshot": None, "pairs": [], "taken": None, "since": None, "left_out": {}}
    snapshot = product(live, live.state.snapshot, Snapshot)
    return {
        "snapshot": snapshot.digest,
        "pairs": [_about(live, pair) for pair in snapshot.pairs],
        "taken": taken_at(live, snapshot.digest),
        "since": moved_since(live, live.rover, snapshot.state),
        "left_out": dict(snapshot.left_out),
    }


def _about(live: LiveSession, pair: ImagePair) -> PairAnswer:
    return {
        "name": pair.name,
        "time": pair.time,
        "width": pair.camera_left.width,
        "height": pair.camera_left.height,
        "baseline": pair.baseline,
        "left": session_path(live, "images", pair.name, "left.png"),
        "right": session_path(live, "images", pair.name, "right.png"),
    }


@router.post("/sessions/{session}/images", status_code=202)
def ask_images(live: OneSession, order: ImageRequest) -> ImagesAsked:
    """Ask the rover for images; they arrive as an event."""
    live.rover.request_images(None if order.pairs is None else tuple(order.pairs))
    return {"requested": order.pairs}


@router.get("/sessions/{session}/images/{pair}/{side}.png", response_class=Response, responses=files("image/png"))
def read_image(
    live: OneSession,
    pair: PairName,
    side: Side,
    of: SnapshotName = "current",
) -> Response:
    """One image of the newest snapshot, or of another one of the session."""
    _, found = pair_of(live, of, pair)
    return Response(encode_png(found.left if side == "left" else found.right), media_type="image/png")


def pair_of(live: LiveSession, of: str, pair: str) -> tuple[Snapshot, ImagePair]:
    """A snapshot of the session (digest, or ``current``) and its pair of that name. Raises NotFound."""
    snapshot = product(live, of, Snapshot, live.state.snapshot)
    for found in snapshot.pairs:
        if found.name == pair:
            return snapshot, found
    raise NotFound(f"the snapshot has no pair {pair!r}; it has {', '.join(p.name for p in snapshot.pairs)}")


@router.post(
    "/sessions/{session}/images/upload",
    status_code=201,
    openapi_extra=multipart_doc({"left": "left image, PNG", "right": "right image, PNG"}, {"calibration": Calibration}),
)
async def upload_pair(live: OneSession, request: Request, sessions: AllSessions) -> Digested:
    """A rectified stereo pair from elsewhere, with its calibration as JSON."""
    async with form_of(request, ("left", "right"), ("calibration",)) as form:
        calibration = json_of(form, "calibration", Calibration)
        sides = [upload_of(form, "left"), upload_of(form, "right")]
        with sessions.pixels.of(client_of(request)) as held:
            return await in_turn(_take_pair, live, calibration, sides, held)


def _take_pair(live: LiveSession, calibration: Calibration, sides: list[Uploaded], held: HeldPixels) -> Digested:
    if live.state.state is None and live.rover.frame is None:
        raise Conflict("a snapshot needs the rover's state; give it with POST telemetry or state first")
    # in a what-if the rover stands, and its cameras with it, where that counts from
    digest = live.state.what_if or live.state.state or live.stances.freeze()
    state = product(live, digest, RobotState)
    packed = [(file.read(), name) for name, file in sides]
    # an image that is too large by itself is refused by its name, before it is unpacked
    held.take(sum(pixels for content, _ in packed if (pixels := claimed_pixels(content)) <= MAX_PIXELS))
    left, right = (decode_image(content, name) for content, name in packed)
    pose = state.T_site_base if calibration.T_site_base is None else np.array(calibration.T_site_base, float)
    pair = ImagePair(
        name=calibration.name,
        time=state.time,
        left=left,
        right=right,
        camera_left=_camera(f"{calibration.name} left", calibration.camera_left),
        camera_right=_camera(f"{calibration.name} right", calibration.camera_right),
        T_site_base=pose,
    )
    return {"digest": live.rover.take_images(Snapshot(state, (pair,)), held)}


def _camera(name: str, model: CameraModel) -> Camera:
    members = model.model_dump(exclude={"T_base_camera"})
    return Camera(name=name, T_base_camera=np.array(model.T_base_camera, float), **members)
