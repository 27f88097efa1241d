"""How large a body each address takes: known from its path, before a byte of it is read.

What is not named here takes JSON, and little of it. Files belong where the interface says so.
"""

import re

from footfall.api.access import BASE, STOP
from footfall.telemetry.link import MAX_BINARY_FRAME

LOGIN_BYTES = 4 << 10
"""Of a login."""
STOP_BYTES = 4 << 10
"""Of a stop's reason; a stop is never refused for more, it goes without."""
JSON_BYTES = 64 << 10
"""Of every other request without files."""
JSON_PARTS = 2000
"""Members and elements of such a body: a state has a thousand. Each may be an error to tell of."""
TELEMETRY_BYTES = 8 << 20
"""Of telemetry by requests. What is more than its route takes, and less than this, is told to the rover and counted."""
TELEMETRY_PARTS = 500_000
"""Members and elements of it; a frame of six legs has two hundred, and a request up to a thousand frames."""
FRAME_BYTES = 2 * MAX_BINARY_FRAME
"""Of the rover's images by requests, and of its messages on the link; likewise."""

_SESSION = BASE + r"/sessions/[^/]+"
_FILES = re.compile(
    rf"{_SESSION}/(terrains|terrains/blend|terrains/scans|terrains/photographs|images/upload|sequences/import)|{BASE}/recordings"
)
_OWN = {
    f"{BASE}/login": LOGIN_BYTES,
    STOP: STOP_BYTES,
    f"{BASE}/rover/telemetry": TELEMETRY_BYTES,
    f"{BASE}/rover/images": FRAME_BYTES,
}


def takes_files(path: str) -> bool:
    """Whether files are sent to this address."""
    return _FILES.fullmatch(path) is not None


def body_limit(path: str, most: int) -> int:
    """Largest body at an address [bytes]. most: where files are sent, and anywhere at all."""
    return most if takes_files(path) else min(most, _OWN.get(path, JSON_BYTES))
