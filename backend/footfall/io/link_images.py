"""Images on the rover link: one binary frame, which is a header and the PNG files it announces.

::

    4 bytes   length of the header, big-endian
    header    UTF-8 JSON: {"type": "images", "id", "state", "pairs": [{"name", "time", "T_site_base",
              "camera_left", "camera_right", "left_bytes", "right_bytes"}]}, and "time_right" where it is not "time"
    PNGs      left and right of each pair in order, grey, 8 bit

A pair that can't be used (no image of one camera, a wrong size, a pose that is not finite) is left out by its name;
the others are kept. Only what makes the frame itself unreadable refuses all of it.
"""

import io
import json
import struct
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from footfall.core.errors import InvalidImages, InvalidInput, InvalidTelemetry
from footfall.io.image_files import claimed_pixels
from footfall.telemetry.fields import Fields, parse_object
from footfall.telemetry.images import LONGEST_NAME, Camera, ImagePair, Snapshot
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.link import MAX_BINARY_FRAME
from footfall.telemetry.link_state import camera_from, camera_object, state_from, state_object

MAX_HEADER = 1 << 20
"""Longest header [bytes]."""
MAX_FRAME_PIXELS = 100_000_000
"""Of all images of one frame, as their heads claim: a PNG of nothing unpacks to a thousand times its size."""

_LENGTH = struct.Struct(">I")


def encode_images(request_id: str, snapshot: Snapshot) -> bytes:
    """One binary frame. request_id: of the image request that it answers."""
    files: list[bytes] = []
    pairs: list[dict[str, object]] = []
    for pair in snapshot.pairs:
        left, right = _png(pair.left), _png(pair.right)
        files += [left, right]
        pairs.append(
            {
                "name": pair.name,
                "time": pair.time,
                **({} if pair.time_right is None else {"time_right": pair.time_right}),
                "T_site_base": pair.T_site_base.tolist(),
                "camera_left": camera_object(pair.camera_left),
                "camera_right": camera_object(pair.camera_right),
                "left_bytes": len(left),
                "right_bytes": len(right),
            }
        )
    body = {"type": "images", "id": request_id, "state": state_object(snapshot.state), "pairs": pairs}
    header = json.dumps(body, allow_nan=False).encode()
    return b"".join([_LENGTH.pack(len(header)), header, *files])


def decode_images(
    frame: bytes,
    legs: int | None = None,
    unpacks: Callable[[int], Any] = lambda _: None,
    described: JointLayout | None = None,
) -> tuple[str, Snapshot]:
    """Request id and snapshot of a binary frame; pairs that can't be used stand in its ``left_out``.

    legs, described: as :func:`footfall.telemetry.link_state.read_state` takes them.
    unpacks: told how many pixels there are before any is unpacked; what it raises is raised.
    Raises InvalidTelemetry where the frame can't be read, InvalidImages, with each reason, where no pair is left.
    """
    start = _end_of_header(frame)
    fields = Fields(parse_object(frame[_LENGTH.size : start], finite=False), "images")
    fields.choice("type", ("images",))
    request_id = fields.identifier()
    state = state_from(fields.inner("state"), legs, described)
    bodies = fields.objects("pairs")
    fields.end()
    packed: list[tuple[str, bytes, bytes]] = []
    for number, body in enumerate(bodies):
        name = body.get("name")
        name = name if isinstance(name, str) and 0 < len(name) <= LONGEST_NAME else f"number {number + 1}"
        left, right, start = _files(body, frame, start, name)
        packed.append((name, left, right))
    pixels = sum(claimed_pixels(png, ("PNG",)) for _, *both in packed for png in both)
    if pixels > MAX_FRAME_PIXELS:
        raise InvalidImages(
            f"the images of the frame have {pixels} pixels; a frame has at most {MAX_FRAME_PIXELS}: send fewer pairs",
            pixels=pixels,
            limit=MAX_FRAME_PIXELS,
        )
    unpacks(pixels)
    pairs, left_out = _usable(bodies, packed)
    if start != len(frame):
        raise InvalidTelemetry(f"{len(frame) - start} bytes follow the last image of the frame")
    if left_out and not pairs:
        raise InvalidImages("no image pair can be used: " + "; ".join(left_out.values()), pairs=left_out)
    return request_id, Snapshot(state, tuple(pairs), left_out)


def _end_of_header(frame: bytes) -> int:
    """Where the first image begins. Raises InvalidTelemetry for a frame that can't have its header."""
    if len(frame) > MAX_BINARY_FRAME:
        raise InvalidTelemetry(
            f"a binary frame has at most {MAX_BINARY_FRAME} bytes", bytes=len(frame), fault="too-large"
        )
    if len(frame) < _LENGTH.size:
        raise InvalidTelemetry("a binary frame begins with the length of its header in 4 bytes", bytes=len(frame))
    (length,) = _LENGTH.unpack_from(frame)
    if length > min(MAX_HEADER, len(frame) - _LENGTH.size):
        raise InvalidTelemetry("the header is longer than its frame, or than 1 MiB", header=length, bytes=len(frame))
    return _LENGTH.size + length


def _usable(
    bodies: list[dict[str, object]], packed: list[tuple[str, bytes, bytes]]
) -> tuple[list[ImagePair], dict[str, str]]:
    """The pairs that can be used, and why not the others, by name. packed: name, left and right PNG of each."""
    pairs: list[ImagePair] = []
    left_out: dict[str, str] = {}
    for number, (body, (name, left, right)) in enumerate(zip(bodies, packed, strict=True)):
        try:
            if name in left_out or any(pair.name == name for pair in pairs):
                name = f"number {number + 1}"
                raise InvalidImages("another pair of the frame has this name", pair=name)
            pairs.append(_pair(body, left, right))
        except InvalidInput as err:
            left_out[name] = f"pair {name}: {err.message.removeprefix(f'pair {name}: ')}"
    return pairs, left_out


def _files(body: dict[str, object], frame: bytes, start: int, name: str) -> tuple[bytes, bytes, int]:
    """Both PNGs of a pair, empty where a camera gave none, and where the next pair's begin."""
    fields = Fields(body, "image pair")
    middle = start + fields.whole("left_bytes")
    end = middle + fields.whole("right_bytes")
    if end > len(frame):
        raise InvalidTelemetry(f"the images of pair {name} are cut short", announced=end, bytes=len(frame))
    return frame[start:middle], frame[middle:end], end


def _pair(body: dict[str, object], left: bytes, right: bytes) -> ImagePair:
    # a rover that does not say when the right image was taken means: at the same time
    fields = Fields({"time_right": body.get("time"), **body}, "image pair")
    name = fields.text("name", longest=LONGEST_NAME)
    camera_left, camera_right = camera_from(fields.inner("camera_left")), camera_from(fields.inner("camera_right"))
    time, time_right = fields.number("time"), fields.number("time_right")
    T_site_base = fields.array("T_site_base", (4, 4))
    for counted in ("left_bytes", "right_bytes"):
        fields.whole(counted)
    fields.end()
    return ImagePair(
        name=name,
        time=time,
        left=_pixels(left, camera_left, "left"),
        right=_pixels(right, camera_right, "right"),
        camera_left=camera_left,
        camera_right=camera_right,
        T_site_base=T_site_base,
        time_right=None if time_right == time else time_right,
    )


def _png(image: NDArray[np.uint8]) -> bytes:
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG", compress_level=1)
    return out.getvalue()


def _pixels(png: bytes, camera: Camera, side: str) -> NDArray[np.uint8]:
    if not png:
        raise InvalidImages(f"the {side} camera gave no image")
    try:
        # the size is looked at before any pixel is unpacked, so a bomb stays packed
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(png), formats=("PNG",))
        if image.mode != "L" or image.size != (camera.width, camera.height):
            raise InvalidImages(
                f"{camera.name}: the image is {image.mode} {image.size}, "
                f"its camera wants 8-bit grey {(camera.width, camera.height)}"
            )
        return np.asarray(image)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombWarning, Image.DecompressionBombError) as err:
        raise InvalidImages(
            f"{camera.name}: this is no readable PNG image: damaged or too large", bytes=len(png)
        ) from err
