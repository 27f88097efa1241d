"""Maps for one leg: computed by a job, described, read layer by layer as PNG or as numbers."""

from typing import Annotated, TypedDict

import numpy as np
from fastapi import Path, Query, Response

from footfall.api.access import Digest, OneSession, product
from footfall.api.auth.who import Who
from footfall.api.bodies.answers import JobAnswer
from footfall.api.bodies.schemas import MapOrder, SuggestionOrder
from footfall.api.bodies.settings_models import settings_value
from footfall.api.routes.jobs import accepted
from footfall.api.routing import Routes, files
from footfall.core.grid import GridGeometry
from footfall.core.value import Value
from footfall.io.map_files import changed_png, layer_npy, layer_png, maps_geotiff
from footfall.maps.colors import layer_legend
from footfall.maps.layers import LAYERS, UNKNOWN, MapSettings, MapStack
from footfall.maps.quality_settings import FACTORS, WEIGHTS, QualitySettings
from footfall.maps.suggest import Explanation, Suggestions
from footfall.session.access.identity import Role
from footfall.session.answers.jobs import Share
from footfall.session.answers.notes import DigestText

router = Routes(tags=["maps"])

LayerName = Annotated[str, Path(description="name of a layer, as `GET layers` has it", max_length=100)]
ChangedLayer = Annotated[str, Query(description="a layer that may hold less than the others", max_length=100)]
Metres = Annotated[float, Query(description="site frame [m]", allow_inf_nan=False, ge=-1e8, le=1e8)]


class LegendEntry(TypedDict):
    """One colour of a layer."""

    text: str
    rgb: list[int]


class LayerAnswer(TypedDict):
    """One layer; known: share of the cells."""

    unit: str
    title: str
    text: str
    min: float | None
    max: float | None
    known: Share
    legend: list[LegendEntry]


class MapsAnswer(TypedDict):
    """Maps of one leg."""

    digest: DigestText
    leg: int
    stability: str
    geometry: GridGeometry
    parents: dict[str, str]
    settings: Value | None
    not_lifted: str
    layers: dict[str, LayerAnswer]


class LayerListed(TypedDict):
    """A layer that maps can have."""

    name: str
    title: str
    unit: str
    text: str


class LayerGroup(TypedDict):
    """Layers that belong together."""

    title: str
    layers: list[LayerListed]


class FactorListed(LayerListed):
    """A factor of footfall quality."""

    weight: float


class LayersAnswer(TypedDict):
    """Every layer and every factor."""

    groups: list[LayerGroup]
    factors: list[FactorListed]


@router.post("/sessions/{session}/maps", status_code=202)
def compute(live: OneSession, order: MapOrder, response: Response) -> JobAnswer:
    """Traversability, reach and stability for one leg, as a job."""
    settings = settings_value(MapSettings, order.settings)
    return accepted(live.maps.compute(order.leg, settings), response)


@router.get("/sessions/{session}/maps/{digest}.tif", response_class=Response, responses=files("image/tiff"))
def download(live: OneSession, digest: Digest) -> Response:
    """All layers as the bands of one GeoTIFF."""
    stack = product(live, digest, MapStack)
    name = f'attachment; filename="maps-leg{stack.leg}-{stack.digest[:8]}.tif"'
    headers = {"Content-Disposition": name}
    return Response(maps_geotiff(stack), media_type="image/tiff", headers=headers)


@router.get("/sessions/{session}/maps/{digest}")
def describe(live: OneSession, digest: Digest) -> MapsAnswer:
    """The layers with unit, range and legend; the cells are in the layers' files."""
    stack = product(live, digest, MapStack)
    return {
        "digest": stack.digest,
        "leg": stack.leg,
        "stability": stack.stability,
        "geometry": stack.geometry,
        "parents": dict(stack.provenance.parents),
        "settings": stack.provenance.settings,
        "not_lifted": stack.not_lifted,
        "layers": {name: _about(stack, name) for name in stack.layers},
    }


def _about(stack: MapStack, name: str) -> LayerAnswer:
    info = LAYERS[name]
    cells = stack.layers[name]
    known = cells[np.isfinite(cells) if cells.dtype.kind == "f" else cells != UNKNOWN]
    return {
        "unit": info.unit,
        "title": info.title,
        "text": info.text,
        "min": known.min() if known.size else None,
        "max": known.max() if known.size else None,
        "known": known.size / cells.size,
        "legend": [{"text": words, "rgb": list(rgb)} for words, rgb in layer_legend(stack, name)],
    }


@router.get("/layers")
def layers() -> LayersAnswer:
    """Every layer that maps can have, in groups, and every factor of footfall quality, with its usual weight."""
    groups: dict[str, list[LayerListed]] = {}
    for name, info in LAYERS.items():
        about: LayerListed = {"name": name, "title": info.title, "unit": info.unit, "text": info.text}
        groups.setdefault(info.group, []).append(about)
    factors: list[FactorListed] = [
        {"name": name, "title": factor.title, "unit": factor.unit, "text": factor.meaning, "weight": WEIGHTS[name]}
        for name, factor in FACTORS.items()
    ]
    return {"groups": [{"title": title, "layers": named} for title, named in groups.items()], "factors": factors}


@router.get("/sessions/{session}/maps/{digest}/at")
def read_out(live: OneSession, digest: Digest, x: Metres, y: Metres) -> Explanation:
    """Every layer's value at a point [m], and what decides whether the leg may stand there."""
    return live.maps.explain(product(live, digest, MapStack), x, y)


@router.post("/sessions/{session}/suggestions")
def suggestions(live: OneSession, order: SuggestionOrder, who: Who) -> Suggestions:
    """The best footfalls on the current maps of a leg, ranked, each with its reasons.

    Whoever may change the view has them shown in the scene.
    """
    return live.maps.suggest(
        live.robot.require_leg(order.leg),
        count=order.count,
        separation=order.separation,
        towards=None if order.towards is None else (order.towards[0], order.towards[1]),
        settings=settings_value(QualitySettings, order.settings),
        show=who.role >= Role.PLANNER,
    )


@router.get("/sessions/{session}/maps/{digest}/changed.png", response_class=Response, responses=files("image/png"))
def changed_image(live: OneSession, digest: Digest, layer: ChangedLayer = "") -> Response:
    """Where a newer terrain has made the latest maps of a leg wrong, as stripes, north up; clear where they hold."""
    stack = product(live, digest, MapStack)
    nowhere = np.zeros(stack.geometry.shape, bool)
    changed = live.fits.maps_changed(stack.leg, layer) if live.state.maps.get(str(stack.leg)) == digest else ~nowhere
    return Response(changed_png(nowhere if changed is None else changed), media_type="image/png")


@router.get("/sessions/{session}/maps/{digest}/{layer}.png", response_class=Response, responses=files("image/png"))
def layer_image(live: OneSession, digest: Digest, layer: LayerName) -> Response:
    """One layer in the colours of the page, north up."""
    return Response(layer_png(product(live, digest, MapStack), layer), media_type="image/png")


@router.get(
    "/sessions/{session}/maps/{digest}/{layer}.npy",
    response_class=Response,
    responses=files("application/octet-stream"),
)
def layer_numbers(live: OneSession, digest: Digest, layer: LayerName) -> Response:
    """One layer as a numpy array, row 0 south."""
    return Response(layer_npy(product(live, digest, MapStack), layer), media_type="application/octet-stream")
