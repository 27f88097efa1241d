"""Photographs: stereo pairs of any calibrated cameras, uploaded together, made into a terrain by a job."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fastapi import Request, Response

from footfall.api.access import AllSessions, OneSession, client_of, product
from footfall.api.bodies.answers import PhotographJob
from footfall.api.bodies.schemas import PhotographOptions
from footfall.api.bodies.settings_models import settings_value
from footfall.api.door.in_turn import in_turn
from footfall.api.door.limits import MAX_IMAGE_BYTES, MAX_IMAGES
from footfall.api.door.multipart import Uploaded, copied, form_of, json_of, multipart_doc, uploads_of
from footfall.api.routes.jobs import accepted
from footfall.api.routing import Routes
from footfall.core.errors import InvalidImages
from footfall.io.photograph_files import PAIRS_FILE, pair_and_side, pixels_in, read_photographs
from footfall.session.live import LiveSession
from footfall.session.pixels import HeldPixels
from footfall.session.reading import Read
from footfall.telemetry.photographs import Photographs
from footfall.telemetry.state import RobotState
from footfall.terrain.terrain_settings import TerrainSettings

router = Routes(tags=["images"])

MAX_TEXT_BYTES = 1 << 20

LONGEST_NAME = 200
"""Of a file [bytes]."""

_NAME = re.compile(r"\w[\w .+-]*")


@router.post(
    "/sessions/{session}/terrains/photographs",
    status_code=202,
    openapi_extra=multipart_doc(
        {
            "calibration": "FootFall's calibration file; or two, left and right camera_info of ROS",
            "images": f"up to {MAX_IMAGES}: NAME_left.png, NAME_right.png, …",
            "pairs": "pairs.yaml: when and where each pair was taken",
        },
        {"options": PhotographOptions},
        optional=("pairs",),
        several={"calibration": 2, "images": MAX_IMAGES},
    ),
)
async def build_from_photographs(
    live: OneSession, request: Request, response: Response, sessions: AllSessions
) -> PhotographJob:
    """Build a terrain from uploaded pairs, which need not be rectified; a job. Formats: docs/calibration.md.

    A pair that can't be used is left out: ``left_out`` here, and of the terrain, says which and why.
    """
    async with form_of(request, ("calibration", "images", "pairs"), ("options",), MAX_IMAGES + 3) as form:
        calibration = uploads_of(form, "calibration", 2, MAX_TEXT_BYTES)
        images = uploads_of(form, "images", MAX_IMAGES, MAX_IMAGE_BYTES)
        pairs = uploads_of(form, "pairs", 1, MAX_TEXT_BYTES)
        options = json_of(form, "options", PhotographOptions)
        with sessions.pixels.of(client_of(request)) as held:
            return await in_turn(_build, live, sessions.read, held, calibration, images, pairs, options, response)


def _build(
    live: LiveSession,
    read: Read,
    held: HeldPixels,
    calibration: list[Uploaded],
    images: list[Uploaded],
    pairs: list[Uploaded],
    options: PhotographOptions,
    response: Response,
) -> PhotographJob:
    pose = None
    if options.with_rover:
        pose = product(live, "current", RobotState, live.state.what_if or live.state.state).T_site_base
    with TemporaryDirectory(prefix="footfall-") as folder:
        photographs = _read(read, held, Path(folder), calibration, images, pairs, options.cameras, pose)
    settings = settings_value(TerrainSettings, options.settings)
    job = live.terrains.build_from_photographs(photographs, settings, with_rover=options.with_rover)
    pairs_used = [pair.name for pair in photographs.pairs]
    return {**accepted(job, response), "pairs": pairs_used, "left_out": dict(photographs.left_out)}


def _read(
    read: Read,
    held: HeldPixels,
    folder: Path,
    calibration: list[Uploaded],
    images: list[Uploaded],
    pairs: list[Uploaded],
    names: list[str] | None,
    pose: Any,
) -> Photographs:
    """The files on disk, under names that can do no harm, for the reader that the command line uses too."""
    written: set[str] = set()
    for name, file in images:
        if not _harmless(name) or pair_and_side(name) is None:
            raise InvalidImages(f"{name!r} is no image of a pair: its name must be NAME_left.png or NAME_right.png")
        if name in written:
            raise InvalidImages(f"{name} was sent twice", file=name)
        written.add(name)
        copied(file, folder / name)
    for _, file in pairs:
        copied(file, folder / PAIRS_FILE)
    files = []
    for side, (name, file) in zip(("left", "right"), calibration, strict=False):
        # what messages call them: the name that they came by, where a file can have it
        plain = name if _harmless(name) else f"{side}.yaml"
        path = folder / side / plain
        path.parent.mkdir()
        copied(file, path)
        files.append(path)
    if not images:
        raise InvalidImages("the form needs files called 'images': NAME_left.png and NAME_right.png of each pair")
    held.take(read(pixels_in, folder, names))
    return read(read_photographs, folder, files, names, pose)


def _harmless(name: str) -> bool:
    return _NAME.fullmatch(name) is not None and len(name.encode()) <= LONGEST_NAME
