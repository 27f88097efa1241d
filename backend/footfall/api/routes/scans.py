"""Scans and depth images, uploaded with what they don't say themselves, become the session's terrain."""

from fastapi import Request, Response

from footfall.api.access import AllSessions, OneSession, session_path
from footfall.api.bodies.answers import TerrainAnswer
from footfall.api.bodies.scan_schemas import ScanOptions
from footfall.api.bodies.settings_models import settings_value
from footfall.api.door.in_turn import in_turn
from footfall.api.door.multipart import Uploaded, form_of, json_of, multipart_doc, on_disk, upload_of
from footfall.api.routes.terrains import BESIDE, about_terrain, beside_of
from footfall.api.routing import Routes
from footfall.io.scan_terrain import read_scan_terrain
from footfall.io.terrain_sidecars import MOST_BESIDE
from footfall.session.live import LiveSession
from footfall.session.reading import Read
from footfall.terrain.scan import ScanSettings

router = Routes(tags=["terrains"])


@router.post(
    "/sessions/{session}/terrains/scans",
    status_code=201,
    openapi_extra=multipart_doc(
        {"file": "scan: PLY, PCD, LAS, LAZ, XYZ, CSV or VTK; or depth image: npz or PNG of 16 bits", "beside": BESIDE},
        {"options": ScanOptions},
        optional=("beside",),
        several={"beside": MOST_BESIDE},
    ),
)
async def load_scan(live: OneSession, request: Request, response: Response, sessions: AllSessions) -> TerrainAnswer:
    """Make the ground that a scan or a depth image shows the session's terrain. Formats: docs/terrain-files.md."""
    async with form_of(request, ("file", "beside"), ("options",), most=1 + MOST_BESIDE) as form:
        file = upload_of(form, "file")
        beside, options = beside_of(form, file.name), json_of(form, "options", ScanOptions)
        about = await in_turn(_load, live, sessions.read, file, beside, options)
    response.headers["Location"] = session_path(live, "terrains", about["digest"])
    return about


def _load(live: LiveSession, read: Read, file: Uploaded, beside: list[Uploaded], options: ScanOptions) -> TerrainAnswer:
    calibration = None if options.calibration is None else options.calibration.members()
    with on_disk(file, beside) as path:
        dem = read(
            read_scan_terrain,
            path,
            settings_value(ScanSettings, options.settings),
            unit=options.unit,
            up=options.up,
            pose=options.pose,
            calibration=calibration,
        )
    live.terrains.load(dem, source=file.name)
    return about_terrain(dem)
