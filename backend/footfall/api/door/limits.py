"""How much the server takes: what it asks of each client, and what a file may hold. ``GET info`` lists all of it."""

import math
from collections.abc import Mapping
from typing import Any

from footfall.api.door.body_limits import JSON_BYTES, JSON_PARTS, LOGIN_BYTES, STOP_BYTES, TELEMETRY_PARTS
from footfall.api.door.holding import IN_ALL, OF_ONE
from footfall.core.errors import InvalidInput
from footfall.core.strict_json import MOST_DEEP
from footfall.core.value import Value, value
from footfall.io.bundles import MAX_FILES, MAX_RATIO, MAX_SESSION_BYTES, MAX_ZIP_BYTES
from footfall.io.event_log import MAX_LINE
from footfall.io.image_files import MAX_PIXELS
from footfall.io.link_images import MAX_FRAME_PIXELS
from footfall.io.terrain_mesh_files import MAX_TRIANGLES
from footfall.session.pixels import IN_ALL as PIXELS_IN_ALL
from footfall.session.pixels import OF_ONE as PIXELS_OF_ONE
from footfall.session.reading import MOST_MEMORY, MOST_SECONDS
from footfall.telemetry.fields import MESSAGE_PARTS
from footfall.telemetry.link import MAX_BINARY_FRAME, MAX_TEXT_FRAME
from footfall.terrain.dem import MAX_CELLS


@value
class Limits(Value):
    """Of one request, and of how often one client may ask. Stop is never counted.

    request_bytes: largest body, where files are sent; header_bytes: all headers together, names and values.
    requests_per_second: of one client in the long run; request_burst: how many may come at once after a pause.
    """

    request_bytes: int = 64 << 20
    header_bytes: int = 32 << 10
    requests_per_second: float = 200.0
    request_burst: int = 2000

    def check(self) -> None:
        for name in ("request_bytes", "header_bytes", "request_burst"):
            if getattr(self, name) < 1:
                raise InvalidInput(f"{name} must be at least 1", **{name: getattr(self, name)})
        if not 0 < self.requests_per_second < math.inf:
            raise InvalidInput("requests_per_second must be above zero", requests_per_second=self.requests_per_second)


LIMITS = Limits()

MAX_IMAGES = 64
"""Photographs in one upload."""
MAX_IMAGE_BYTES = 16 << 20
"""Of one photograph in an upload."""
MAX_LINE_MESSAGE = STOP_BYTES
"""Longest message of a page on its line of stops, or of events [bytes]."""
LINE_BYTES = 64 << 10
"""A WebSocket on which more than this comes at once is closed without reading it; the rover's and the scene's apart."""
TOO_BIG = 1009
"""Close code of a WebSocket on which a longer message came."""
MOST_LISTENERS = 64
"""Open streams and lines of events, of all sessions; one more is kept for who holds the conn."""
MOST_OF_ONE = 32
"""Of these, of one account; where there are no accounts, of one address."""
PAGE_ITEMS = 1000
"""Items on one page of a long list."""

IN_FILES: Mapping[str, int] = {
    "images": MAX_IMAGES,
    "image_bytes": MAX_IMAGE_BYTES,
    "image_pixels": MAX_PIXELS,
    "upload_pixels": PIXELS_OF_ONE,
    "terrain_cells": MAX_CELLS,
    "mesh_triangles": MAX_TRIANGLES,
    "bundle_files": MAX_FILES,
    "bundle_bytes_unpacked": MAX_ZIP_BYTES,
    "bundle_unpack_ratio": MAX_RATIO,
    "bundle_session_bytes": MAX_SESSION_BYTES,
    "bundle_line_bytes": MAX_LINE,
    "reading_bytes": MOST_MEMORY,
    "reading_seconds": int(MOST_SECONDS),
    "rover_text_bytes": MAX_TEXT_FRAME,
    "rover_binary_bytes": MAX_BINARY_FRAME,
    "rover_message_parts": MESSAGE_PARTS,
    "telemetry_parts": TELEMETRY_PARTS,
    "rover_frame_pixels": MAX_FRAME_PIXELS,
    "line_message_bytes": MAX_LINE_MESSAGE,
    "bodies_held_bytes": IN_ALL,
    "bodies_held_of_one_bytes": OF_ONE,
    "pixels_held": PIXELS_IN_ALL,
    "pixels_held_of_one": PIXELS_OF_ONE,
    "login_bytes": LOGIN_BYTES,
    "json_bytes": JSON_BYTES,
    "json_depth": MOST_DEEP,
    "json_parts": JSON_PARTS,
    "listeners": MOST_LISTENERS,
    "listeners_of_one": MOST_OF_ONE,
    "page_items": PAGE_ITEMS,
}
"""What every door holds to, whoever asks: name → the limit of the module that enforces it."""


def all_limits(limits: Limits, jobs_waiting: int | None) -> dict[str, Any]:
    """Every limit by name. jobs_waiting: how many jobs may wait; None: there is no queue."""
    own = {name: getattr(limits, name) for name in ("request_bytes", "header_bytes")}
    pace = {name: getattr(limits, name) for name in ("requests_per_second", "request_burst")}
    return {**own, **pace, "jobs_waiting": jobs_waiting, **IN_FILES}
