"""What the first scene of a page is made of: bytes, triangles and draw calls of each drawn thing.

``python -m benchmarks.scene_parts``: the rock-step sample, whose rover stands on 401 × 401 cells, as a page without a
graphics card is sent it. *Sent* is what goes through the WebSocket in all, where viser packs what is no array; of
single things it is what they are before. Labels and lines have no triangles here: viser makes both of them itself.
"""

import json
import struct
import sys
from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import msgspec
import viser
import zstandard
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from benchmarks.console.apart import Apart, served_apart
from benchmarks.console.scene_line import CAMERA, PROTOCOL, QUIET, SESSION
from benchmarks.timing import machine

MOST = 3_000_000
"""Bytes of a first scene."""
LONGEST = 60.0
"""Wait for its first message [s]; what comes after a pause of five times QUIET is not of the first scene."""
STRIP = 5


@dataclass
class Thing:
    """One name in the scene: what was sent for it, and what a picture of it takes."""

    bytes: int = 0
    triangles: int = 0
    draw_calls: int = 0
    each: int = 0
    """Triangles of one of a batch, at its finest, as seen from nearby; 0: it is no batch."""


@dataclass
class Heard:
    """All that a page was sent. sent: bytes; hidden: names that are not shown."""

    sent: int = 0
    things: dict[str, Thing] = field(default_factory=lambda: defaultdict(Thing))
    hidden: set[str] = field(default_factory=set)

    def take(self, frame: bytes) -> None:
        """One message of the WebSocket: packed ones first, then the arrays that they name."""
        self.sent += len(frame)
        packed = frame[16 : 16 + int.from_bytes(frame[8:16], "little")]
        told = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(packed))
        for message in told["messages"]:
            name = message.get("name", "")
            thing, lengths = self.things[name], told["binaryBufferLengths"]
            thing.bytes += len(msgspec.msgpack.encode(message)) + sum(lengths[i] for i in _arrays(message))
            if "props" in message:
                thing.triangles, thing.draw_calls = _drawn(message["type"], message["props"], lengths)
                thing.each = thing.triangles if "batched_positions" in message["props"] else 0
            for told_of in (message.get("props", {}), message.get("updates", {})):
                if thing.each and "batched_positions" in told_of:
                    # three numbers of four bytes for each of the batch
                    thing.triangles = thing.each * (lengths[told_of["batched_positions"]["__binary_index"]] // 12)
            if message["type"] == "SetSceneNodeVisibilityMessage":
                (self.hidden.discard if message["visible"] else self.hidden.add)(name)

    def shown(self, name: str) -> bool:
        """Whether it and all that carries it is."""
        parts = name.split("/")
        return not any("/".join(parts[: i + 1]) in self.hidden for i in range(1, len(parts)))


def _arrays(value: Any) -> list[int]:
    """Numbers of the arrays that a message names."""
    if isinstance(value, dict):
        if "__binary_index" in value:
            return [value["__binary_index"]]
        return [one for inner in value.values() for one in _arrays(inner)]
    return [one for inner in value for one in _arrays(inner)] if isinstance(value, (list, tuple)) else []


def _drawn(kind: str, props: dict[str, Any], lengths: tuple[int, ...]) -> tuple[int, int]:
    """Triangles and draw calls; of a batch, those of one."""
    match kind:
        case "GlbMessage" | "BatchedGlbMessage":
            return of_glb(props["glb_data"])
        case "MeshMessage" | "BatchedMeshesMessage":
            return lengths[props["faces"]["__binary_index"]] // 12, 1
        case "IcosphereMessage":
            return 20 * 4 ** props["subdivisions"], 1
        case "LineSegmentsMessage" | "ArrowMessage":
            return 0, 1
    return 0, 0


def of_glb(content: bytes) -> tuple[int, int]:
    """Triangles and draw calls of a binary glTF."""
    tree = json.loads(content[20 : 20 + struct.unpack("<I", content[12:16])[0]])
    parts = [one for mesh in tree.get("meshes", ()) for one in mesh["primitives"]]
    counts = [(tree["accessors"][one["indices"]]["count"], one.get("mode")) for one in parts]
    return sum(count - 2 if mode == STRIP else count // 3 for count, mode in counts), len(parts)


def listen(socket: Connection, wait: float = 5 * QUIET) -> Heard:
    """All that comes until nothing has for ``wait`` seconds."""
    heard = Heard()
    pause = LONGEST
    while True:
        try:
            frame = socket.recv(timeout=pause)
        except TimeoutError:
            return heard
        heard.take(frame if isinstance(frame, bytes) else frame.encode())
        pause = wait


def first_and_next(served: Apart) -> tuple[Heard, Heard]:
    """The first scene, and what another layer adds to it."""
    url = served.line("/scene?page=parts")
    with (
        served.client() as client,
        connect(url, subprotocols=[PROTOCOL], proxy=None, max_size=None, origin=Origin(served.url)) as socket,
    ):
        socket.send(msgspec.msgpack.encode(CAMERA.as_serializable_dict()))
        first = listen(socket)
        headers = {"FootFall-Page": "parts"}
        client.put(f"{SESSION}/view", json={"layer": "slope"}, headers=headers).raise_for_status()
        return first, listen(socket)


def main() -> int:
    """Prints them, the heaviest first. Returns 1 where the first scene is heavier than MOST."""
    about = machine()
    print(f"{about['processor']}, {about['cores']} cores, Python {about['python']}, viser {viser.__version__}")
    with served_apart(rover=False) as served:
        page = served.client().get(f"{served.url}/scene/").num_bytes_downloaded
        first, other = first_and_next(served)
    print(f"{'':<40}{'bytes':>12}{'triangles':>12}{'draw calls':>12}")
    for told, things in (("all that is shown", _shown(first)), *_groups(first)):
        print(f"{told:<40}" + "".join(f"{sum(getattr(one, what) for one in things):>12}" for what in WHAT))
    print(f"sent for the first scene: {first.sent} bytes, {MOST} are allowed; viser's own page: {page}")
    print(f"sent for another layer: {other.sent} bytes")
    return 1 if first.sent > MOST else 0


WHAT = ("bytes", "triangles", "draw_calls")


def _shown(heard: Heard) -> list[Thing]:
    return [thing for name, thing in heard.things.items() if heard.shown(name)]


def _groups(heard: Heard) -> list[tuple[str, list[Thing]]]:
    """By the first part of their names, the heaviest first; what is hidden has bytes alone."""
    groups: dict[str, list[Thing]] = defaultdict(list)
    for name, thing in heard.things.items():
        shown = thing if heard.shown(name) else Thing(thing.bytes)
        groups[name.split("/")[1] if name.startswith("/") else "page and view"].append(shown)
    return sorted(groups.items(), key=lambda group: -sum(one.bytes for one in group[1]))


if __name__ == "__main__":
    sys.exit(main())
