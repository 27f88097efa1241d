"""What a recording holds, and a live viewer is shown, of each thing that was said: messages on topics, as bytes."""

import json
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from mcap.well_known import MessageEncoding, SchemaEncoding
from numpy.typing import NDArray

from footfall.core.errors import InvalidTelemetry
from footfall.io import ros2_messages as ros2
from footfall.io.cdr import CdrWriter
from footfall.io.link_images import encode_images
from footfall.io.recordings import (
    ACKNOWLEDGEMENTS,
    CAMERA_INFO,
    COMMANDED,
    FRAME,
    FRAME_MESSAGE,
    IMAGES,
    MEASURED,
    MESSAGES,
    MODE,
    TF,
    TF_STATIC,
    TO_ROVER,
    wheel_force_topic,
)
from footfall.io.recordings.images import split_images
from footfall.telemetry.images import Snapshot
from footfall.telemetry.state import TelemetryFrame


class Form(NamedTuple):
    """How the messages of a topic are written: name, encoding and text of their schema, and their own encoding."""

    name: str
    schema_encoding: str
    schema: bytes
    encoding: str


class Written(NamedTuple):
    """One message. kind: name of a ROS 2 message."""

    topic: str
    kind: str
    data: bytes


def form_of(kind: str) -> Form:
    """The form of a kind of messages. All are CDR: ROS 2 opens no file of several encodings."""
    return Form(kind, SchemaEncoding.ROS2, MESSAGES[kind].encode(), MessageEncoding.CDR)


def topics(legs: int, pairs: tuple[str, ...]) -> dict[str, str]:
    """Topic → kind, of all that is said of a rover with these legs and camera pairs."""
    found = {MEASURED: ros2.JOINT_STATE, COMMANDED: ros2.JOINT_STATE, TF: ros2.TRANSFORMS}
    found |= {wheel_force_topic(leg): ros2.WRENCH for leg in range(legs)}
    found |= {MODE: ros2.TEXT, FRAME: FRAME_MESSAGE, TF_STATIC: ros2.TRANSFORMS}
    for pair in pairs:
        for side in ("left", "right"):
            topic = _image_topic(pair, side)
            found |= {topic: ros2.IMAGE, f"{topic}/{CAMERA_INFO}": ros2.CAMERA_INFO}
    return {**found, IMAGES: ros2.TEXT, TO_ROVER: ros2.TEXT, ACKNOWLEDGEMENTS: ros2.TEXT}


def _plain(pair: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]", "_", pair)


def _image_topic(pair: str, side: str) -> str:
    return f"/footfall/{_plain(pair)}/{side}"


def optical_frame(pair: str, side: str) -> str:
    """The frame of a camera, z forward, x right, y down, named as REP 103 has it."""
    return f"{_plain(pair)}_{side}_optical"


def of_frame(frame: TelemetryFrame, names: tuple[str, ...]) -> list[Written]:
    """A telemetry frame; names: of the joints, leg by leg. Raises InvalidTelemetry where its number is too large."""
    state = frame.state
    if not 0 <= frame.number < 1 << 64:
        raise InvalidTelemetry("a recorded frame has a number below 2**64", number=frame.number)
    own = CdrWriter()
    own.pack("Q", frame.number)
    own.string(state.robot)
    own.pack("d", state.time)
    own.fixed_floats(state.T_site_base)
    now = state.time
    return [
        Written(MEASURED, ros2.JOINT_STATE, ros2.joint_state(now, names, state.posture, state.joint_torques)),
        Written(COMMANDED, ros2.JOINT_STATE, ros2.joint_state(now, names, frame.commanded)),
        Written(TF, ros2.TRANSFORMS, ros2.transforms(now, "site", {"base": state.T_site_base})),
        *(
            Written(wheel_force_topic(leg), ros2.WRENCH, ros2.wrench(now, "site", force))
            for leg, force in enumerate(state.wheel_forces)
        ),
        Written(MODE, ros2.TEXT, ros2.text(state.mode)),
        Written(FRAME, FRAME_MESSAGE, own.message()),
    ]


def of_images(snapshot: Snapshot) -> list[Written]:
    """Images: each as a message that others show, its camera, and the header that puts them together again.

    Both images of a pair, and both cameras' infos, are in the frame of the left one: so do ROS's stereo tools want it,
    to whom P of the right one says where it lies.
    """
    header, files = split_images(encode_images("recorded", snapshot))
    messages = _camera_poses(snapshot)
    for pair, left, right in zip(snapshot.pairs, files[::2], files[1::2], strict=True):
        time_right = pair.time if pair.time_right is None else pair.time_right
        for side, camera, taken, file, baseline in (
            ("left", pair.camera_left, pair.time, left, 0.0),
            ("right", pair.camera_right, time_right, right, pair.baseline),
        ):
            topic = _image_topic(pair.name, side)
            frame = optical_frame(pair.name, "left")
            messages.append(Written(topic, ros2.IMAGE, ros2.compressed_image(taken, frame, file)))
            info = ros2.camera_info(taken, frame, camera, baseline)
            messages.append(Written(f"{topic}/{CAMERA_INFO}", ros2.CAMERA_INFO, info))
    return [*messages, Written(IMAGES, ros2.TEXT, ros2.text(header.decode()))]


def _camera_poses(snapshot: Snapshot) -> list[Written]:
    """Where the cameras sit on the chassis: at the time of each image, for players that lose what is static, and for
    good behind that."""
    messages: list[Written] = []
    together: dict[str, NDArray[np.float64]] = {}
    for pair in snapshot.pairs:
        cameras = (("left", pair.camera_left), ("right", pair.camera_right))
        poses = {optical_frame(pair.name, side): camera.T_base_camera for side, camera in cameras}
        for taken in {pair.time: None, pair.time if pair.time_right is None else pair.time_right: None}:
            messages.append(Written(TF, ros2.TRANSFORMS, ros2.transforms(taken, "base", poses)))
        together |= poses
    static = ros2.transforms(snapshot.state.time, "base", together)
    return [*messages, Written(TF_STATIC, ros2.TRANSFORMS, static)]


def of_object(topic: str, body: Mapping[str, Any]) -> list[Written]:
    """A JSON object on a topic of its own. Raises InvalidTelemetry for what is no JSON."""
    try:
        content = json.dumps(dict(body), allow_nan=False)
    except (TypeError, ValueError) as err:
        raise InvalidTelemetry(f"what is recorded as JSON must be plain: {err}", topic=topic) from err
    return [Written(topic, ros2.TEXT, ros2.text(content))]
