"""Terrains: rebuilt from images by a job, uploaded as a file, described, downloaded."""

from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Annotated, Literal, TypedDict

import numpy as np
from fastapi import Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from footfall.api.access import AllSessions, Digest, OneSession, product, session_path
from footfall.api.bodies.answer_models import answer_model
from footfall.api.bodies.answers import JobAnswer, TerrainAnswer
from footfall.api.bodies.schemas import BlendOptions, BuildTerrain, ClearTerrain, TerrainOptions
from footfall.api.bodies.settings_models import changed, settings_value
from footfall.api.door.in_turn import in_turn
from footfall.api.door.json_bodies import small_body
from footfall.api.door.multipart import (
    Uploaded,
    form_of,
    is_multipart,
    json_of,
    multipart_doc,
    on_disk,
    parse,
    upload_of,
    uploads_of,
)
from footfall.api.routes.jobs import accepted
from footfall.api.routing import Routes, files
from footfall.core.errors import InvalidInput
from footfall.io.map_files import relief_png
from footfall.io.terrain_files import encode_collision_mesh, read_terrain, write_terrain
from footfall.io.terrain_sidecars import MOST_BESIDE, names_beside
from footfall.session.answers.jobs import Share
from footfall.session.jobs.job import Job
from footfall.session.live import LiveSession
from footfall.session.reading import Read
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.age import BANDS, age_shares
from footfall.terrain.terrain_settings import BlendSettings

router = Routes(tags=["terrains"])

_BYTES = "application/octet-stream"
Extension = Literal["npz", "tif", "asc", "ply", "obj", "stl", "off"]
BESIDE = "a file that belongs to it and says how to read it: .prj, .aux.xml, .msk, .tfw, …; may be given several times"
MeshExtension = Literal["ply", "obj", "stl", "off"]

_one_at_a_time = Lock()
"""The library that simplifies keeps its mesh in a global."""


@router.post(
    "/sessions/{session}/terrains",
    status_code=201,
    responses={201: {"model": answer_model(TerrainAnswer)}, 202: {"model": answer_model(JobAnswer)}},
    openapi_extra=multipart_doc(
        {"file": "GeoTIFF, ESRI ASCII grid, npz, PLY, OBJ, OFF, STL or grey PNG", "beside": BESIDE},
        {"options": TerrainOptions},
        BuildTerrain,
        optional=("beside",),
        several={"beside": MOST_BESIDE},
    ),
)
async def make_terrain(
    live: OneSession, request: Request, response: Response, sessions: AllSessions
) -> TerrainAnswer | JobAnswer:
    """JSON: rebuild from the session's images (202, a job). A form with a file: read that terrain (201)."""
    if is_multipart(request):
        async with form_of(request, ("file", "beside"), ("options",), most=1 + MOST_BESIDE) as form:
            file = upload_of(form, "file")
            beside, options = beside_of(form, file.name), json_of(form, "options", TerrainOptions)
            about = await in_turn(_load, live, sessions.read, file, beside, options)
        response.headers["Location"] = session_path(live, "terrains", about["digest"])
        return about
    order = parse(await small_body(request), BuildTerrain)
    return accepted(await run_in_threadpool(_build, live, order), response)


def _build(live: LiveSession, order: BuildTerrain) -> Job:
    return live.terrains.build(changed(live.terrains.delivered(), order.settings))


def beside_of(form: FormData, name: str) -> list[Uploaded]:
    """Files that belong to the terrain file; others are refused, as nothing would read them."""
    found = uploads_of(form, "beside", MOST_BESIDE)
    wanted = names_beside(name)
    for other, _ in found:
        if other.lower() not in wanted:
            raise InvalidInput(
                f"{other} does not belong to {name}; beside it may lie: {', '.join(sorted(wanted))}", file=other
            )
    return found


def _load(
    live: LiveSession, read: Read, file: Uploaded, beside: list[Uploaded], options: TerrainOptions
) -> TerrainAnswer:
    with on_disk(file, beside) as path:
        dem = read(read_terrain, path, **options.arguments())
    live.terrains.load(dem, source=file.name)
    return about_terrain(dem)


def about_terrain(dem: Dem) -> TerrainAnswer:
    """Size, bounds and heights of a terrain, without its cells."""
    known = np.isfinite(dem.heights)
    west, south, east, north = dem.geometry.bounds
    error = dem.height_error
    return {
        "digest": dem.digest,
        "name": dem.name,
        "rows": dem.geometry.rows,
        "cols": dem.geometry.cols,
        "resolution": dem.geometry.resolution,
        "bounds": {"west": west, "south": south, "east": east, "north": north},
        "known": float(known.mean()),
        "lowest": float(dem.heights[known].min()),
        "highest": float(dem.heights[known].max()),
        "texture": dem.texture is not None,
        "remembers": dem.remembers,
        "sources": list(dem.sources),
        "left_out": dict(dem.left_out),
        "true_north_deg": dem.true_north,
        "height_error": None if error is None else {"p95": error.p95, "most": error.most},
        "parents": dict(dem.provenance.parents),
    }


@router.post(
    "/sessions/{session}/terrains/blend",
    status_code=202,
    openapi_extra=multipart_doc(
        {"file": "terrain known from elsewhere, such as a GeoTIFF", "beside": BESIDE},
        {"options": BlendOptions},
        optional=("beside",),
        several={"beside": MOST_BESIDE},
    ),
)
async def blend(live: OneSession, request: Request, response: Response, sessions: AllSessions) -> JobAnswer:
    """Lay an uploaded terrain, with an uncertainty of its own, under the session's terrain; a job."""
    async with form_of(request, ("file", "beside"), ("options",), most=1 + MOST_BESIDE) as form:
        file = upload_of(form, "file")
        beside, options = beside_of(form, file.name), json_of(form, "options", BlendOptions)
        return accepted(await in_turn(_blend, live, sessions.read, file, beside, options), response)


def _blend(live: LiveSession, read: Read, file: Uploaded, beside: list[Uploaded], options: BlendOptions) -> Job:
    settings = settings_value(BlendSettings, options.settings)
    with on_disk(file, beside) as path:
        external = read(read_terrain, path, **options.read.arguments())
    return live.terrains.blend(external, settings, source=file.name)


@router.post("/sessions/{session}/terrains/undo")
def undo(live: OneSession) -> TerrainAnswer:
    """Go back to the terrain before the present one."""
    return about_terrain(live.typed(Dem, live.terrains.undo()))


@router.post("/sessions/{session}/terrains/clear", status_code=201)
def clear(live: OneSession, order: ClearTerrain, response: Response) -> TerrainAnswer:
    """Make a disc or a polygon of the terrain unknown; the result becomes the session's terrain."""
    digest = live.terrains.clear(order.area())
    response.headers["Location"] = session_path(live, "terrains", digest)
    return about_terrain(live.typed(Dem, digest))


@router.get(
    "/sessions/{session}/terrains/{digest}/collision.{extension}", response_class=Response, responses=files(_BYTES)
)
def download_collision_mesh(
    live: OneSession,
    digest: Digest,
    extension: MeshExtension,
    raise_by: Annotated[float, Query(ge=0, le=10, description="heights go up by this [m]")] = 0.15,
    buffer: Annotated[float, Query(ge=0, le=10, description="what stands grows by this [m]")] = 0.0,
    tolerance: Annotated[float, Query(ge=0.001, le=10, description="most height error of the mesh [m]")] = 0.01,
) -> Response:
    """The terrain as collision checks may see it: grown, raised, with fewer triangles. The map stays as it is.

    The mesh lies nowhere below that ground, and above it by no more than the header Footfall-Height-Error says [m].
    """
    from footfall.terrain.ground.simplified import simplified
    from footfall.terrain.ground.views import CollisionView, collision_view

    dem = product(live, digest, Dem, live.state.dem)
    view = collision_view(dem, CollisionView(raise_by, buffer))
    with _one_at_a_time:
        made = simplified(view, tolerance)
    headers = {
        "Content-Disposition": f'attachment; filename="collision-{dem.digest[:8]}.{extension}"',
        "Footfall-Height-Error": f"{made.error:.6g}",
        "Footfall-Triangles": f"{len(made.mesh.triangles)} of {made.triangles_before}",
    }
    content = encode_collision_mesh(made, f".{extension}")
    return Response(content, media_type=_BYTES, headers=headers)


class AgeBand(TypedDict):
    """Ground from `after` seconds before the newest measurement on; share: of the cells that have a height."""

    after: float
    share: Share


class AgeAnswer(TypedDict):
    """How old the ground is. unknown: share of the cells that have a height, but no time of their measurement."""

    bands: list[AgeBand]
    unknown: Share


@router.get("/sessions/{session}/terrains/{digest}/age")
def read_age(live: OneSession, digest: Digest) -> AgeAnswer:
    """How much of a terrain is how old, as the scene hatches it."""
    shares, unknown = age_shares(product(live, digest, Dem, live.state.dem))
    bands: list[AgeBand] = [
        {"after": after, "share": share} for after, share in zip((0.0, *BANDS), shares, strict=True)
    ]
    return {"bands": bands, "unknown": unknown}


@router.get("/sessions/{session}/terrains/{digest}/relief.png", response_class=Response, responses=files("image/png"))
def read_relief(live: OneSession, digest: Digest) -> Response:
    """The ground from above, north up, lit from the north-west; a pixel for each cell, unknown ground in one colour."""
    return Response(relief_png(product(live, digest, Dem, live.state.dem)), media_type="image/png")


@router.get("/sessions/{session}/terrains/{digest}.{extension}", response_class=Response, responses=files(_BYTES))
def download_terrain(live: OneSession, digest: Digest, extension: Extension) -> Response:
    """The terrain as a file; ``current`` names the session's terrain."""
    dem = product(live, digest, Dem, live.state.dem)
    with TemporaryDirectory(prefix="footfall-") as folder:
        path = Path(folder) / f"terrain.{extension}"
        write_terrain(dem, path)
        content = path.read_bytes()
    name = f'attachment; filename="terrain-{dem.digest[:8]}.{extension}"'
    return Response(content, media_type=_BYTES, headers={"Content-Disposition": name})


@router.get("/sessions/{session}/terrains/{digest}")
def read_one(live: OneSession, digest: Digest) -> TerrainAnswer:
    """What a terrain is; ``current`` names the session's terrain."""
    return about_terrain(product(live, digest, Dem, live.state.dem))
