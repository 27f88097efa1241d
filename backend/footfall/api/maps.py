"""Maps for one leg: computed by a job, described, read layer by layer as PNG or as numbers."""

import io
from typing import Any

import numpy as np
from fastapi import Response

from footfall.api.access import OneSession, product
from footfall.api.jobs import accepted
from footfall.api.routing import Routes
from footfall.api.schemas import MapOrder
from footfall.core.errors import NotFound
from footfall.io.image_files import encode_png
from footfall.maps.colors import layer_legend, layer_rgb
from footfall.maps.layers import LAYERS, UNKNOWN, MapSettings, MapStack
from footfall.session.live import LiveSession

router = Routes(tags=["maps"])


@router.post("/sessions/{session}/maps", status_code=202)
def compute(live: OneSession, order: MapOrder, response: Response) -> dict[str, Any]:
    """Traversability, reach and stability for one leg, as a job."""
    settings = None if order.settings is None else MapSettings(**order.settings.model_dump())
    return accepted(live.compute_maps(live.robot.require_leg(order.leg), settings), response)


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
    unit, text = LAYERS[name]
    cells = stack.layers[name]
    known = cells[np.isfinite(cells) if cells.dtype.kind == "f" else cells != UNKNOWN]
    return {
        "unit": unit,
        "text": text,
        "min": known.min() if known.size else None,
        "max": known.max() if known.size else None,
        "known": known.size / cells.size,
        "legend": [{"text": words, "rgb": list(rgb)} for words, rgb in layer_legend(stack, name)],
    }


@router.get("/sessions/{session}/maps/{digest}/{layer}.png", response_class=Response)
def layer_image(live: OneSession, digest: str, layer: str) -> Response:
    """One layer in the colours of the page, north up."""
    stack = _with_layer(live, digest, layer)
    return Response(encode_png(np.ascontiguousarray(layer_rgb(stack, layer)[::-1])), media_type="image/png")


@router.get("/sessions/{session}/maps/{digest}/{layer}.npy", response_class=Response)
def layer_numbers(live: OneSession, digest: str, layer: str) -> Response:
    """One layer as a numpy array, row 0 south."""
    stack = _with_layer(live, digest, layer)
    out = io.BytesIO()
    np.save(out, stack.layers[layer], allow_pickle=False)
    return Response(out.getvalue(), media_type="application/octet-stream")


def _with_layer(live: LiveSession, digest: str, layer: str) -> MapStack:
    stack = product(live, digest, MapStack)
    if layer not in stack.layers:
        raise NotFound(f"there is no layer {layer!r}; there are {', '.join(stack.layers)}")
    return stack
