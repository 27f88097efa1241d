"""Images on the rover link come back pixel for pixel; broken frames are refused."""

import io
import json
import struct

import numpy as np
import pytest
from PIL import Image

from footfall.core.errors import InvalidImages, InvalidTelemetry
from footfall.core.frames import transform
from footfall.io.link_images import decode_images, encode_images
from footfall.telemetry.images import Camera, ImagePair, Snapshot


@pytest.fixture
def snapshot(standing, rng) -> Snapshot:
    def camera(name: str, x: float) -> Camera:
        return Camera(name, 32, 24, 28.0, 28.0, 15.5, 11.5, transform(translation=(x, 0.0, 0.0)))

    def pair(name: str) -> ImagePair:
        left, right = (rng.integers(0, 256, (24, 32), np.uint8) for _ in range(2))
        cameras = camera(f"{name}_left", 0.0), camera(f"{name}_right", 0.2)
        return ImagePair(name, standing.time, left, right, *cameras, standing.T_site_base)

    return Snapshot(standing, (pair("nav0"), pair("haz1")))


def repacked(frame: bytes, change) -> bytes:
    (length,) = struct.unpack_from(">I", frame)
    header = json.loads(frame[4 : 4 + length])
    change(header)
    text = json.dumps(header).encode()
    return struct.pack(">I", len(text)) + text + frame[4 + length :]


def test_a_snapshot_comes_back_the_same(snapshot):
    request, again = decode_images(encode_images("r1", snapshot), legs=6)
    assert request == "r1"
    assert again.digest == snapshot.digest


def test_broken_frames_are_refused(snapshot):
    frame = encode_images("r1", snapshot)
    cases = [
        (b"", "4 bytes"),
        (struct.pack(">I", 10**6) + frame[4:], "longer than its frame"),
        (frame[:-1], "cut short"),
        (frame + b"x", "1 bytes follow"),
        (repacked(frame, lambda h: h.update(type="pictures")), "type"),
        (repacked(frame, lambda h: h["pairs"][0].update(left_bytes=0)), "left_bytes"),
        (repacked(frame, lambda h: h["pairs"][0].pop("time")), "time is missing"),
        (repacked(frame, lambda h: h["state"].update(posture=[0.0] * 30)), "posture needs 36"),
    ]
    for broken, says in cases:
        with pytest.raises(InvalidTelemetry, match=says):
            decode_images(broken, legs=6)


def test_broken_images_are_refused(snapshot):
    frame = encode_images("r1", snapshot)
    with pytest.raises(InvalidImages, match="its camera wants"):
        decode_images(repacked(frame, lambda h: h["pairs"][0]["camera_left"].update(width=33)))
    with pytest.raises(InvalidImages, match="at least one"):
        decode_images(_without_pairs(frame))
    (length,) = struct.unpack_from(">I", frame)
    scrambled = bytearray(frame)
    scrambled[4 + length : 4 + length + 8] = b"notapng!"
    with pytest.raises(InvalidImages, match="no readable PNG"):
        decode_images(bytes(scrambled))


def _without_pairs(frame: bytes) -> bytes:
    bare = repacked(frame, lambda h: h.update(pairs=[]))
    (length,) = struct.unpack_from(">I", bare)
    return bare[: 4 + length]


def test_a_colour_image_is_refused(snapshot):
    frame = encode_images("r1", snapshot)
    (length,) = struct.unpack_from(">I", frame)
    header = json.loads(frame[4 : 4 + length])
    colour = io.BytesIO()
    Image.fromarray(np.zeros((24, 32, 3), np.uint8)).save(colour, "PNG")
    old = header["pairs"][0]["left_bytes"]
    header["pairs"][0]["left_bytes"] = len(colour.getvalue())
    text = json.dumps(header).encode()
    with pytest.raises(InvalidImages, match="RGB"):
        decode_images(struct.pack(">I", len(text)) + text + colour.getvalue() + frame[4 + length + old :])
