"""How long a stop takes while others do their worst, and what memory that costs: one row an attack, and one of none.

The server is a process of its own, as `footfall serve` starts it; so is who attacks. Stops come by request, each on a
connection of its own, and by the page's line, in turn.
"""

import contextlib
import io
import itertools
import json
import multiprocessing
import random
import socket
import struct
import threading
import time
import zipfile
import zlib
from collections.abc import Callable, Iterator
from functools import cache
from multiprocessing.synchronize import Event
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Subprotocol

from benchmarks.soak.processes import ServerProcess
from benchmarks.timing import Figure
from footfall.api.access import BASE
from footfall.io.bundles import FORMAT, VERSION, log_bytes
from footfall.io.event_log import START, make_record
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.telemetry.link import AckMessage, HelloMessage, encode
from footfall.terrain.generate import rock_field

LIMIT = 0.5
"""What a stop may take, under every attack [s]."""
MOST_MEMORY = 1024.0
"""What an attack may cost beside the idle server [MiB]."""
AT_ONCE = 4
"""Who attacks does it from so many connections, where the attack names no other number."""
SESSION = f"{BASE}/sessions/current"


def figures(quick: bool) -> Iterator[Figure]:
    count = 20 if quick else 100
    with TemporaryDirectory(prefix=".footfall-bench-", dir=".") as work:
        data = Path(work) / "data"
        with Sessions(data, InlineJobs()) as sessions:
            live = sessions.create("attacked")
            live.load_terrain(rock_field(size=40.0, resolution=0.04, seed=3), "made for the benchmark")
            name = live.id
        server = ServerProcess(data, name, Path(work) / "log")
        server.start()
        try:
            with connect(f"ws://127.0.0.1:{server.port}{BASE}/stop/line", proxy=None) as line:
                _stops(server.port, line, 5)
                idle = at_rest(server.pid)
                for told, attack in ATTACKS.items():
                    with _attacked(attack, server.port), _peak(server.pid) as memory:
                        times = _stops(server.port, line, count)
                    yield Figure(f"attacks.stop, {told}", times, "s", floor=LIMIT, p95_at_most=LIMIT)
                    cost = max(memory) - idle
                    yield Figure(f"attacks.memory, {told}", (cost,), "MiB", floor=MOST_MEMORY)
        finally:
            server.end()


def _stops(port: int, line: Connection, count: int) -> tuple[float, ...]:
    """How long each stop takes until it is answered, by request and by line in turn."""
    times = []
    for number in range(count):
        begin = time.perf_counter()
        if number % 2:
            line.send("{}")
            stopped = json.loads(line.recv(timeout=120))["stopped"]
        else:
            with _begun(port, f"{BASE}/stop", b"{}", len(b"{}")) as raw:
                stopped = b'"stopped":true' in _answer(raw)
        times.append(time.perf_counter() - begin)
        if not stopped:
            raise RuntimeError("a stop was not answered as one")
        time.sleep(0.05)
    return tuple(times)


def at_rest(pid: int) -> float:
    """Memory of a server once its workers have loaded what they need, as seen by its ceasing to grow [MiB]."""
    before, now = 0.0, resident(pid)
    while now > before + 1.0:
        time.sleep(5.0)
        before, now = now, resident(pid)
    return now


def resident(pid: int) -> float:
    """Memory of a process and of those that it started, shared pages once [MiB]; one that ended has none."""
    try:
        rollup = Path(f"/proc/{pid}/smaps_rollup").read_text()
        shares = [int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:")]
        threads = list(Path(f"/proc/{pid}/task").iterdir())
        started = [child for one in threads for child in (one / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return sum(shares) / 1024 + sum(resident(int(child)) for child in started)


@contextlib.contextmanager
def _peak(pid: int) -> Iterator[list[float]]:
    found, over = [resident(pid)], threading.Event()

    def look() -> None:
        while not over.wait(0.1):
            found.append(resident(pid))

    looking = threading.Thread(target=look)
    looking.start()
    try:
        yield found
    finally:
        over.set()
        looking.join()


@contextlib.contextmanager
def _attacked(attack: "Attack", port: int) -> Iterator[None]:
    context = multiprocessing.get_context("spawn")
    going, over = context.Event(), context.Event()
    process = context.Process(target=_go, args=(attack, port, going, over), daemon=True)
    process.start()
    if not going.wait(120):
        raise RuntimeError("the attack did not begin")
    try:
        yield
    finally:
        over.set()
        process.join(5)
        process.kill()


def _go(attack: "Attack", port: int, going: Event, over: Event) -> None:
    def again() -> None:
        while not over.is_set():
            with contextlib.suppress(Exception):  # it is refused in many ways, and goes on
                attack(port)
            going.set()
            time.sleep(0.01)

    for _ in range(AT_ONCE):
        threading.Thread(target=again, daemon=True).start()
    time.sleep(1.0)  # one that never ends is going by now
    going.set()
    over.wait()


# -- attacks: each is made again when it has ended ---------------------------------------------

Attack = Callable[[int], None]


def _begun(port: int, path: str, body: bytes = b"", length: int | None = None, kind: str = "") -> socket.socket:
    """A request of which this much was sent. length: what its head says; None: it comes in pieces."""
    host = f"127.0.0.1:{port}"
    how = "Transfer-Encoding: chunked" if length is None else f"Content-Length: {length}"
    head = f"POST {path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: {kind or 'application/json'}\r\n{how}\r\n\r\n"
    raw = socket.create_connection(("127.0.0.1", port), timeout=120)
    raw.sendall(head.encode() + (b"%x\r\n%s\r\n" % (len(body), body) if length is None else body))
    return raw


def _answer(raw: socket.socket) -> bytes:
    found = b""
    while b"\r\n\r\n" not in found or not found.endswith((b"}", b"]")):
        part = raw.recv(1 << 16)
        if not part:
            break
        found += part
    return found


def _whole(port: int, path: str, body: bytes, kind: str = "") -> None:
    with _begun(port, path, body, len(body), kind) as raw:
        _answer(raw)


def _in_pieces(port: int, path: str, body: bytes) -> None:
    with _begun(port, path, body) as raw:
        raw.sendall(b"0\r\n\r\n")
        _answer(raw)


def nothing(port: int) -> None:
    """Nobody attacks."""
    time.sleep(0.1)


def many_names(port: int) -> None:
    """20 000 names, two of them alike, as a login."""
    names = ",".join(f'"n{i}":1' for i in range(20_000))
    _whole(port, f"{BASE}/login", f'{{{names},"n7":1}}'.encode())


def many_lists(port: int) -> None:
    """60 MB of empty objects, as a note, without saying how many."""
    _in_pieces(port, f"{SESSION}/notes", b"[" + b"{}," * (20 << 20) + b"{}]")


def many_errors(port: int) -> None:
    """As many wrong members as a note may have bytes."""
    _whole(port, f"{SESSION}/notes", json.dumps({f"n{i}": {} for i in range(4500)}).encode())


def telemetry(port: int) -> None:
    """4 MiB of numbers where a rover sends telemetry."""
    _whole(port, f"{BASE}/rover/telemetry", b"[" + b"1," * (2 << 20) + b"1]")


def deep(port: int) -> None:
    """Lists within lists."""
    _whole(port, f"{SESSION}/notes", b"[" * (64 << 10))


def unfinished(port: int) -> None:
    """56 MB of a file that does not end, from ten connections."""
    some = []
    for _ in range(10):
        with contextlib.suppress(OSError):
            some.append(_begun(port, f"{SESSION}/terrains", bytes(56 << 20), kind="multipart/form-data; boundary=x"))
    time.sleep(3.0)
    for raw in some:
        raw.close()


def uploads(port: int) -> None:
    """Files of 60 MB that are no terrain."""
    head = b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.asc"\r\n\r\n'
    _whole(
        port,
        f"{SESSION}/terrains",
        head + b"ncols 1 " * (7 << 20) + b"\r\n--x--\r\n",
        "multipart/form-data; boundary=x",
    )


def large_stops(port: int) -> None:
    """60 MiB at once on lines of stops."""
    with connect(f"ws://127.0.0.1:{port}{BASE}/stop/line", proxy=None, max_size=None) as line:
        line.send(bytes(60 << 20))
        line.recv(timeout=60)


def many_stops(port: int) -> None:
    """Stops without end."""
    with connect(f"ws://127.0.0.1:{port}{BASE}/stop/line", proxy=None) as line:
        for _ in range(200):
            line.send("{}")
            line.recv(timeout=60)


def chatty_rover(port: int) -> None:
    """4 000 acknowledgements, and the next 4 000."""
    spoken = [Subprotocol("footfall-rover-2")]
    with connect(f"ws://127.0.0.1:{port}{BASE}/rover", subprotocols=spoken, proxy=None) as link:
        link.send(encode(HelloMessage("athlete", 6)))
        for number, state in zip(range(4000), itertools.cycle(("received", "started")), strict=False):
            link.send(encode(AckMessage(f"c{number % 7}", state, "", 1.0)))


def blank_images(port: int) -> None:
    """12 pairs of blank images of 9 000 × 9 000 pixels."""
    _whole(port, f"{BASE}/rover/images?protocol=2", _blank_frame(), "application/octet-stream")


def _blank_frame() -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    side = 9000
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
    pairs = [{"name": f"p{i}", **pair, "left_bytes": len(png), "right_bytes": len(png)} for i in range(12)]
    header = json.dumps({"type": "images", "id": "x", "state": still, "pairs": pairs}).encode()
    return struct.pack(">I", len(header)) + header + png * 24


def unread(port: int) -> None:
    """25 downloads of a terrain that nobody reads."""
    some = [socket.create_connection(("127.0.0.1", port), timeout=120) for _ in range(25)]
    for raw in some:
        path = f"{SESSION}/terrains/current.npz"
        raw.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
    time.sleep(3.0)
    for raw in some:
        raw.close()


def _file(port: int, path: str, name: str, content: bytes, options: str = "{}") -> None:
    """A form with a file, as the page sends it."""
    part = '--x\r\nContent-Disposition: form-data; name="{}"{}\r\n\r\n'
    head = part.format("options", "").encode() + options.encode()
    head += b"\r\n" + part.format("file", f'; filename="{name}"').encode()
    _whole(port, f"{SESSION}/{path}", head + content + b"\r\n--x--\r\n", "multipart/form-data; boundary=x")


def large_terrain(port: int) -> None:
    """A good ASCII grid of 15.2 million cells, 30 MB."""
    rows = b"0 " * 3900 + b"\n"
    _file(port, "terrains", "a.asc", b"ncols 3900\nnrows 3900\nxllcorner 0\nyllcorner 0\ncellsize 0.1\n" + rows * 3900)


def large_scan(port: int) -> None:
    """A good text of 10 million points, 60 MB."""
    _file(port, "terrains/scans", "a.xyz", b"0 0 0\n9 9 1\n" * 5_000_000, '{"unit": "m", "up": "z"}')


def unpacking_scan(port: int) -> None:
    """A depth image that unpacks to 275 MB."""
    calibration = '{"calibration": {"fx": 5000, "fy": 5000, "cx": 3000, "cy": 3000}}'
    _file(port, "terrains/scans", "a.npz", _depth_image(), calibration)


@cache
def _depth_image() -> bytes:
    packed = io.BytesIO()
    np.savez_compressed(packed, depth=np.zeros((6000, 6000)))
    return packed.getvalue()


def large_bundle(port: int) -> None:
    """A session whose only artifact unpacks to 2 GB, and not quite to 200 times what it is packed."""
    _whole(port, f"{BASE}/recordings", _bundle(), "application/zip")


@cache
def _bundle() -> bytes:
    packed = io.BytesIO()
    part = random.Random(1).randbytes(1 << 13) + bytes((1 << 20) - (1 << 13))
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as bundle:
        bundle.writestr("session.json", json.dumps({"format": FORMAT, "version": VERSION}))
        bundle.writestr("events.jsonl", log_bytes([make_record(0, 1.0, "session_created", {}, START)]))
        with bundle.open(f"artifacts/{'0' * 32}.bin", "w", force_zip64=True) as file:
            for _ in range(2048):
                file.write(part)
    return packed.getvalue()


ATTACKS: dict[str, Attack] = {
    "no attack": nothing,
    "20 000 names at the login": many_names,
    "60 MB of objects": many_lists,
    "4 500 errors": many_errors,
    "4 MiB of numbers": telemetry,
    "lists within lists": deep,
    "bodies that do not end": unfinished,
    "uploads of 60 MB": uploads,
    "60 MiB on stop lines": large_stops,
    "stops without end": many_stops,
    "a chatty rover": chatty_rover,
    "blank images": blank_images,
    "unread downloads": unread,
    "terrains just under the limits": large_terrain,
    "scans just under the limits": large_scan,
    "scans that unpack": unpacking_scan,
    "bundles just under the limits": large_bundle,
}
