"""Maps for one leg: computed by a job, described, read layer by layer as PNG or as numbers."""

from typing import Any

import numpy as np
from fastapi import Response

from footfall.api.access import OneSession, product
from footfall.api.jobs import accepted
from footfall.api.routing import Routes
from footfall.api.schemas import MapOrder, SuggestionOrder, settings_value
from footfall.io.map_files import layer_npy, layer_png, maps_geotiff
from footfall.maps.colors import layer_legend
from footfall.maps.layers import LAYERS, UNKNOWN, MapSettings, MapStack
from footfall.maps.quality_settings import QualitySettings
from footfall.maps.suggest import Explanation, Suggestions

router = Routes(tags=["maps"])


@router.post("/sessions/{session}/maps", status_code=202)
def compute(live: OneSession, order: MapOrder, response: Response) -> dict[str, Any]:
    """Traversability, reach and stability for one leg, as a job."""
    settings = settings_value(MapSettings, order.settings)
    return accepted(live.compute_maps(live.robot.require_leg(order.leg), settings), response)


@router.get("/sessions/{session}/maps/{digest}.tif", response_class=Response)
def download(live: OneSession, digest: str) -> Response:
    """All layers as the bands of one GeoTIFF."""
    stack = product(live, digest, MapStack)
    name = f'attachment; filename="maps-leg{stack.leg}-{stack.digest[:8]}.tif"'
    headers = {"Content-Disposition": name}
    return Response(maps_geotiff(stack), media_type="image/tiff", headers=headers)


@router.get("/sessions/{session}/maps/{digest}")
def describe(live: OneSession, digest: str) -> dict[str, Any]:
    """The layers with unit, range and legend; the cells are in the layers' files."""
    stack = product(live, digest, MapStack)
    return {
        "digest": stack.digest,
        "leg": stack.leg,
        "stability": stack.stability,
        "geometry": stack.geometry,
        "parents": stack.provenance.parents,
        "settings": stack.provenance.settings,
        "layers": {name: _about(stack, name) for name in stack.layers},
    }


def _about(stack: MapStack, name: str) -> dict[str, Any]:
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
def layers() -> dict[str, Any]:
    """Every layer that maps can have, in groups, with title, unit and meaning."""
    groups: dict[str, list[dict[str, str]]] = {}
    for name, info in LAYERS.items():
        about = {"name": name, "title": info.title, "unit": info.unit, "text": info.text}
        groups.setdefault(info.group, []).append(about)
    return {"groups": [{"title": title, "layers": named} for title, named in groups.items()]}


@router.get("/sessions/{session}/maps/{digest}/at")
def read_out(live: OneSession, digest: str, x: float, y: float) -> Explanation:
    """Every layer's value at a point [m], and what decides whether the leg may stand there."""
    return live.explain(product(live, digest, MapStack), x, y)


@router.post("/sessions/{session}/suggestions")
def suggestions(live: OneSession, order: SuggestionOrder) -> Suggestions:
    """The best footfalls on the current maps of a leg, ranked, each with its reasons."""
    return live.suggest(
        live.robot.require_leg(order.leg),
        count=order.count,
        separation=order.separation,
        towards=None if order.towards is None else (order.towards[0], order.towards[1]),
        settings=settings_value(QualitySettings, order.settings),
    )


@router.get("/sessions/{session}/maps/{digest}/{layer}.png", response_class=Response)
def layer_image(live: OneSession, digest: str, layer: str) -> Response:
    """One layer in the colours of the page, north up."""
    return Response(layer_png(product(live, digest, MapStack), layer), media_type="image/png")


@router.get("/sessions/{session}/maps/{digest}/{layer}.npy", response_class=Response)
def layer_numbers(live: OneSession, digest: str, layer: str) -> Response:
    """One layer as a numpy array, row 0 south."""
    return Response(layer_npy(product(live, digest, MapStack), layer), media_type="application/octet-stream")
