"""Attacks on a server: each is made once, and again and again by :mod:`benchmarks.attacks`.

They stop short of nothing that a client on the network can do. Smaller sizes are for tests, where size shows nothing.
"""

import contextlib
import io
import itertools
import json
import random
import socket
import struct
import time
import zipfile
import zlib
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Subprotocol

from footfall.api.access import BASE
from footfall.io.bundles import FORMAT, VERSION, log_bytes
from footfall.io.event_log import START, make_record
from footfall.telemetry.link import AckMessage, HelloMessage, encode

SESSION = f"{BASE}/sessions/current"

Attack = Callable[[int], list[int]]
"""Attacks the server at a port; returns the statuses, or codes of closing, of what it was answered."""


def begun(port: int, path: str, body: bytes = b"", length: int | None = None, kind: str = "") -> socket.socket:
    """A request of which this much was sent. length: what its head says; None: it comes in pieces."""
    host = f"127.0.0.1:{port}"
    how = "Transfer-Encoding: chunked" if length is None else f"Content-Length: {length}"
    head = f"POST {path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: {kind or 'application/json'}\r\n{how}\r\n\r\n"
    raw = socket.create_connection(("127.0.0.1", port), timeout=120)
    raw.sendall(head.encode() + (b"%x\r\n%s\r\n" % (len(body), body) if length is None else body))
    return raw


def answer_of(raw: socket.socket) -> bytes:
    found = b""
    while b"\r\n\r\n" not in found or not found.endswith((b"}", b"]")):
        part = raw.recv(1 << 16)
        if not part:
            break
        found += part
    return found


def _status(answer: bytes) -> list[int]:
    return [int(answer.split(maxsplit=2)[1])] if answer else []


def _so_far(raw: socket.socket) -> list[int]:
    """What was answered by now, and hang up."""
    with raw:
        raw.setblocking(False)
        try:
            return _status(raw.recv(1 << 10))
        except OSError:
            return []


def _closed(line: Connection) -> list[int]:
    """With which code the server closes a line, if it says one before it hangs up."""
    try:
        while True:
            line.recv(timeout=60)
    except ConnectionClosed as closed:
        return [] if closed.rcvd is None else [closed.rcvd.code]


def _whole(port: int, path: str, body: bytes, kind: str = "") -> list[int]:
    with begun(port, path, body, len(body), kind) as raw:
        return _status(answer_of(raw))


def _in_pieces(port: int, path: str, body: bytes) -> list[int]:
    with begun(port, path, body) as raw:
        raw.sendall(b"0\r\n\r\n")
        return _status(answer_of(raw))


def nothing(port: int) -> list[int]:
    """Nobody attacks."""
    time.sleep(0.1)
    return []


def many_names(port: int) -> list[int]:
    """20 000 names, two of them alike, as a login."""
    names = ",".join(f'"n{i}":1' for i in range(20_000))
    return _whole(port, f"{BASE}/login", f'{{{names},"n7":1}}'.encode())


def many_lists(port: int, objects: int = 20 << 20) -> list[int]:
    """60 MB of empty objects, as a note, without saying how many."""
    return _in_pieces(port, f"{SESSION}/notes", b"[" + b"{}," * objects + b"{}]")


def all_listeners(port: int, lines: int = 70) -> list[int]:
    """One client takes every place to listen, and never reads."""
    with contextlib.ExitStack() as open_:
        address, codes = f"ws://127.0.0.1:{port}{SESSION}/events/line", []
        for _ in range(lines):
            line = open_.enter_context(connect(address, proxy=None))
            try:
                line.recv(timeout=60)
            except ConnectionClosed as closed:
                codes += [] if closed.rcvd is None else [closed.rcvd.code]
        return codes


def many_objects(port: int, objects: int = 1 << 20) -> list[int]:
    """3 MiB of empty objects where a rover sends telemetry."""
    return _whole(port, f"{BASE}/rover/telemetry", b'{"frames":[' + b"{}," * objects + b"{}]}")


def half_messages(port: int, pause: float = 3.0) -> list[int]:
    """Twenty messages to scenes, of 3 MiB each, without their end."""
    codes = []
    with contextlib.ExitStack() as open_:
        lines = [open_.enter_context(connect(f"ws://127.0.0.1:{port}/scene", proxy=None)) for _ in range(20)]
        for line in lines:
            with contextlib.suppress(OSError):
                line.socket.sendall(b"\x02\xff" + (3 << 20).to_bytes(8, "big") + bytes(4) + bytes((3 << 20) - 1))
        time.sleep(pause)
        for line in lines:
            with contextlib.suppress(TimeoutError, ConnectionClosed):
                while True:
                    line.recv(timeout=0)
            codes += [] if line.close_code in (None, 1006) else [line.close_code]
    return codes


def many_errors(port: int) -> list[int]:
    """As many wrong members as a note may have bytes."""
    return _whole(port, f"{SESSION}/notes", json.dumps({f"n{i}": {} for i in range(4500)}).encode())


def telemetry(port: int) -> list[int]:
    """4 MiB of numbers where a rover sends telemetry."""
    return _whole(port, f"{BASE}/rover/telemetry", b"[" + b"1," * (2 << 20) + b"1]")


def deep(port: int) -> list[int]:
    """Lists within lists."""
    return _whole(port, f"{SESSION}/notes", b"[" * (64 << 10))


_FILE_BEGINS = b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.asc"\r\n\r\n'
_FORM = "multipart/form-data; boundary=x"


def unfinished(port: int, size: int = 56 << 20, pause: float = 3.0) -> list[int]:
    """56 MB of a file that does not end, from ten connections."""
    some = []
    for _ in range(10):
        with contextlib.suppress(OSError):
            some.append(begun(port, f"{SESSION}/terrains", _FILE_BEGINS + bytes(size), kind=_FORM))
    time.sleep(pause)
    return [status for raw in some for status in _so_far(raw)]


def uploads(port: int, words: int = 7 << 20) -> list[int]:
    """Files of 60 MB that are no terrain."""
    return _whole(port, f"{SESSION}/terrains", _FILE_BEGINS + b"ncols 1 " * words + b"\r\n--x--\r\n", _FORM)


def large_stops(port: int) -> list[int]:
    """60 MiB at once on lines of stops."""
    with connect(f"ws://127.0.0.1:{port}{BASE}/stop/line", proxy=None, max_size=None) as line:
        with contextlib.suppress(ConnectionClosed):  # it may hang up on who goes on sending
            line.send(bytes(60 << 20))
        return _closed(line)


def many_stops(port: int) -> list[int]:
    """Stops without end."""
    with connect(f"ws://127.0.0.1:{port}{BASE}/stop/line", proxy=None) as line:
        for _ in range(200):
            line.send("{}")
            line.recv(timeout=60)
    return []


def chatty_rover(port: int) -> list[int]:
    """4 000 acknowledgements, and the next 4 000."""
    spoken = [Subprotocol("footfall-rover-2")]
    try:
        with connect(f"ws://127.0.0.1:{port}{BASE}/rover", subprotocols=spoken, proxy=None) as link:
            link.send(encode(HelloMessage("athlete", 6)))
            for number, state in zip(range(4000), itertools.cycle(("received", "started")), strict=False):
                link.send(encode(AckMessage(f"c{number % 7}", state, "", 1.0)))
    except InvalidStatus as refused:
        return [refused.response.status_code]
    return []


def blank_images(port: int) -> list[int]:
    """12 pairs of blank images of 9 000 × 9 000 pixels."""
    return _images(port, _blank_frame(9000, 12))


def large_images(port: int, side: int = 7000) -> list[int]:
    """Good pairs of blank images of 98 million pixels, each another one."""
    head, files = _blank_frame(side, 1)
    return _images(port, ({**head, "state": {**head["state"], "time": time.time()}}, files))


def _images(port: int, frame: tuple[dict[str, Any], bytes]) -> list[int]:
    header = json.dumps(frame[0]).encode()
    content = struct.pack(">I", len(header)) + header + frame[1]
    return _whole(port, f"{BASE}/rover/images?protocol=2", content, "application/octet-stream")


@cache
def _blank_frame(side: int, count: int) -> tuple[dict[str, Any], bytes]:
    """Header and files of a frame with so many pairs."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    size = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(side * (side + 1)), 9)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    eye = [[float(i == j) for j in range(4)] for i in range(4)]
    still = {"robot": "athlete", "time": 1.0, "posture": [0.0] * 36, "T_site_base": eye, "mode": "idle"}
    still |= {"wheel_forces": [[0.0] * 3] * 6, "joint_torques": [0.0] * 36}

    def camera(name: str, x: float) -> dict[str, object]:
        pose = [[*row[:3], x if i == 0 else row[3]] for i, row in enumerate(eye)]
        about = {"name": name, "width": side, "height": side, "fx": 5e3, "fy": 5e3, "cx": 4.5e3, "cy": 4.5e3}
        return {**about, "T_base_camera": pose}

    pair = {"time": 1.0, "T_site_base": eye, "camera_left": camera("l", 0.0), "camera_right": camera("r", 0.3)}
    pairs = [{"name": f"p{i}", **pair, "left_bytes": len(png), "right_bytes": len(png)} for i in range(count)]
    return {"type": "images", "id": "x", "state": still, "pairs": pairs}, png * (2 * count)


def unread(port: int, pause: float = 3.0) -> list[int]:
    """25 downloads of a terrain that nobody reads."""
    some = [socket.create_connection(("127.0.0.1", port), timeout=120) for _ in range(25)]
    for raw in some:
        path = f"{SESSION}/terrains/current.npz"
        raw.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
    time.sleep(pause)
    return [status for raw in some for status in _so_far(raw)]


def _file(port: int, path: str, name: str, content: bytes, options: str = "{}") -> list[int]:
    """A form with a file, as the page sends it."""
    part = '--x\r\nContent-Disposition: form-data; name="{}"{}\r\n\r\n'
    head = part.format("options", "").encode() + options.encode()
    head += b"\r\n" + part.format("file", f'; filename="{name}"').encode()
    return _whole(port, f"{SESSION}/{path}", head + content + b"\r\n--x--\r\n", _FORM)


def large_terrain(port: int, side: int = 3900) -> list[int]:
    """A good ASCII grid of 15.2 million cells, 30 MB."""
    rows = b"0 " * side + b"\n"
    head = f"ncols {side}\nnrows {side}\nxllcorner 0\nyllcorner 0\ncellsize 0.1\n".encode()
    return _file(port, "terrains", "a.asc", head + rows * side)


def large_scan(port: int, points: int = 5_000_000) -> list[int]:
    """A good text of 10 million points, 60 MB."""
    return _file(port, "terrains/scans", "a.xyz", b"0 0 0\n9 9 1\n" * points, '{"unit": "m", "up": "z"}')


def unpacking_scan(port: int, side: int = 6000) -> list[int]:
    """A depth image that unpacks to 275 MB."""
    calibration = '{"calibration": {"fx": 5000, "fy": 5000, "cx": 3000, "cy": 3000}}'
    return _file(port, "terrains/scans", "a.npz", _depth_image(side), calibration)


@cache
def _depth_image(side: int) -> bytes:
    packed = io.BytesIO()
    np.savez_compressed(packed, depth=np.zeros((side, side)))
    return packed.getvalue()


def large_bundle(port: int, mib: int = 2048) -> list[int]:
    """A session whose only artifact unpacks to 2 GB, and not quite to 200 times what it is packed."""
    return _whole(port, f"{BASE}/recordings", _bundle(mib), "application/zip")


@cache
def _bundle(mib: int) -> bytes:
    packed = io.BytesIO()
    part = random.Random(1).randbytes(1 << 13) + bytes((1 << 20) - (1 << 13))
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as bundle:
        bundle.writestr("session.json", json.dumps({"format": FORMAT, "version": VERSION}))
        bundle.writestr("events.jsonl", log_bytes([make_record(0, 1.0, "session_created", {}, START)]))
        with bundle.open(f"artifacts/{'0' * 32}.bin", "w", force_zip64=True) as file:
            for _ in range(mib):
                file.write(part)
    return packed.getvalue()


ATTACKS: dict[str, Attack] = {
    "no attack": nothing,
    "20 000 names at the login": many_names,
    "60 MB of objects": many_lists,
    "4 500 errors": many_errors,
    "4 MiB of numbers": telemetry,
    "3 MiB of objects": many_objects,
    "all places to listen": all_listeners,
    "messages that do not end": half_messages,
    "lists within lists": deep,
    "bodies that do not end": unfinished,
    "uploads of 60 MB": uploads,
    "60 MiB on stop lines": large_stops,
    "stops without end": many_stops,
    "a chatty rover": chatty_rover,
    "blank images": blank_images,
    "images just under the limits": large_images,
    "unread downloads": unread,
    "terrains just under the limits": large_terrain,
    "scans just under the limits": large_scan,
    "scans that unpack": unpacking_scan,
    "bundles just under the limits": large_bundle,
}
