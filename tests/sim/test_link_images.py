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
        (repacked(frame, lambda h: h["pairs"][0].update(left_bytes=-1)), "left_bytes"),
        (repacked(frame, lambda h: h["pairs"][0].pop("left_bytes")), "left_bytes is missing"),
        (repacked(frame, lambda h: h["state"].update(posture=[0.0] * 30)), "posture needs 36"),
        (repacked(frame, lambda h: h["state"].update(time=float("nan"))), "finite"),
    ]
    for broken, says in cases:
        with pytest.raises(InvalidTelemetry, match=says):
            decode_images(broken, legs=6)


NAN_POSE = [[float("nan")] * 4] * 4


def without_image(frame: bytes, side: str) -> bytes:
    """The frame as a rover sends it whose first pair lost one camera."""
    (length,) = struct.unpack_from(">I", frame)
    first = json.loads(frame[4 : 4 + length])["pairs"][0]
    start = 4 + length + (0 if side == "left" else first["left_bytes"])
    cut = frame[:start] + frame[start + first[f"{side}_bytes"] :]
    return repacked(cut, lambda h: h["pairs"][0].update({f"{side}_bytes": 0}))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda h: h["pairs"][0].update(T_site_base=NAN_POSE), "T_site_base must be a finite number, not nan"),
        (lambda h: h["pairs"][0].update(T_site_base=[[2.0, 0, 0, 0]] * 4), "no rigid transform"),
        (lambda h: h["pairs"][0]["camera_left"].update(fx=float("nan")), "fx must be a finite number"),
        (lambda h: h["pairs"][0]["camera_right"].update(T_base_camera=NAN_POSE), "T_base_camera"),
        (lambda h: h["pairs"][0]["camera_left"].update(width=33), "its camera wants"),
        (lambda h: h["pairs"][0].update(time=float("inf")), "time must be a finite number"),
        (lambda h: h["pairs"][0].pop("time"), "time is missing"),
        (lambda h: h["pairs"][0].update(extra=1), "unknown fields extra"),
    ],
)
def test_one_bad_pair_is_left_out_by_its_name(snapshot, change, says):
    _, kept = decode_images(repacked(encode_images("r1", snapshot), change), legs=6)
    assert [pair.name for pair in kept.pairs] == ["haz1"]
    assert kept.pairs[0].digest == snapshot.pairs[1].digest
    assert list(kept.left_out) == ["nav0"]
    assert kept.left_out["nav0"].startswith("pair nav0: ")
    assert says in kept.left_out["nav0"]


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_lost_camera_costs_its_pair_only(snapshot, side):
    _, kept = decode_images(without_image(encode_images("r1", snapshot), side), legs=6)
    assert [pair.name for pair in kept.pairs] == ["haz1"]
    assert dict(kept.left_out) == {"nav0": f"pair nav0: the {side} camera gave no image"}


def test_pairs_without_a_name_or_with_the_same_are_told_by_number(snapshot):
    frame = encode_images("r1", snapshot)
    _, kept = decode_images(repacked(frame, lambda h: h["pairs"][0].pop("name")))
    assert list(kept.left_out) == ["number 1"]
    _, kept = decode_images(repacked(frame, lambda h: h["pairs"][1].update(name="nav0")))
    assert [pair.name for pair in kept.pairs] == ["nav0"]
    assert dict(kept.left_out) == {"number 2": "pair number 2: another pair of the frame has this name"}


def test_both_times_of_a_pair_travel(snapshot):
    frame = encode_images("r1", snapshot)
    apart = repacked(frame, lambda h: h["pairs"][0].update(time_right=h["pairs"][0]["time"] + 0.5))
    _, again = decode_images(apart)
    assert again.pairs[0].time_right == pytest.approx(snapshot.pairs[0].time + 0.5)
    assert again.pairs[1].time_right is None
    assert decode_images(encode_images("r1", again))[1].digest == again.digest
    said = repacked(frame, lambda h: [pair.update(time_right=pair["time"]) for pair in h["pairs"]])
    assert decode_images(said)[1].digest == snapshot.digest


def test_broken_images_are_refused(snapshot):
    frame = encode_images("r1", snapshot)
    with pytest.raises(InvalidImages, match="at least one"):
        decode_images(_without_pairs(frame))
    (length,) = struct.unpack_from(">I", frame)
    scrambled = bytearray(frame)
    scrambled[4 + length : 4 + length + 8] = b"notapng!"
    assert "no readable PNG" in decode_images(bytes(scrambled))[1].left_out["nav0"]
    with pytest.raises(InvalidImages, match=r"no image pair can be used: pair nav0: .*; pair haz1: ") as caught:
        decode_images(repacked(frame, lambda h: [pair.update(T_site_base=NAN_POSE) for pair in h["pairs"]]))
    assert list(caught.value.details["pairs"]) == ["nav0", "haz1"]


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
    _, kept = decode_images(struct.pack(">I", len(text)) + text + colour.getvalue() + frame[4 + length + old :])
    assert "RGB" in kept.left_out["nav0"]
