"""A client that speaks Foxglove's protocol sees live what the recording of the same session holds afterwards."""

import json
import struct
import time
from collections.abc import Iterable

import numpy as np
import pytest
from mcap.reader import make_reader
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from footfall.core.errors import Conflict
from footfall.core.frames import transform
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.telemetry.images import Camera, ImagePair, Snapshot
from footfall_ui.foxglove_server import FoxgloveServer
from tests.support.frames import moving_frames
from tests.support.waiting import until

MESSAGE = struct.Struct("<BIQ")  # opcode 1, subscription, log time [ns]; then the message


@pytest.fixture
def sessions(tmp_path):
    with Sessions(tmp_path, jobs=InlineJobs()) as opened:
        opened.create("watched")
        yield opened


@pytest.fixture
def shown(sessions):
    server = FoxgloveServer(sessions, port=0)
    yield server
    server.close()


@pytest.fixture
def snapshot():
    grey = np.random.default_rng(0).integers(0, 256, (12, 16), dtype=np.uint8)
    left, right = (
        Camera(side, 16, 12, 20.0, 21.0, 8.0, 6.0, transform(translation=(x, 0.0, 0.0)))
        for side, x in (("l", 0.0), ("r", 0.3))
    )
    return Snapshot(moving_frames(1)[0].state, (ImagePair("nav0", 5.0, grey, grey, left, right, np.eye(4)),))


class Viewer:
    """Subscribes to every channel that is advertised."""

    def __init__(self, socket) -> None:
        self.socket = socket
        self.channels: dict[int, dict] = {}
        self.got: list[tuple[str, int, bytes]] = []

    def look(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            try:
                said = self.socket.recv(timeout=left)
            except TimeoutError:
                return
            if isinstance(said, bytes):
                opcode, number, at = MESSAGE.unpack_from(said)
                assert opcode == 1
                self.got.append((self.channels[number]["topic"], at, said[MESSAGE.size :]))
            elif (message := json.loads(said))["op"] == "advertise":
                new = {channel["id"]: channel for channel in message["channels"]}
                self.channels |= new
                self.subscribe(new)
            elif message["op"] == "status" and "nknown channel" in message["message"]:
                # the library advertises a channel a moment before it takes subscriptions to it
                self.subscribe([int(message["message"].split()[-1])])

    def subscribe(self, numbers: Iterable[int]) -> None:
        wanted = [{"id": number, "channelId": number} for number in numbers]
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def test_live_channels_schemas_and_messages_are_those_of_the_recording(sessions, shown, snapshot):
    live = sessions.current
    frames = moving_frames(30)

    def say() -> None:
        live.rover.connected(lambda text: None)
        for frame in frames[:10]:
            live.rover.take_telemetry(frame)
        live.rover.take_images(snapshot)
        live.commands.stop("enough")
        live.rover.take_stop_acknowledgement(time=12.0)

    until(lambda: live.rover.recorder._listeners, "the looking on")
    with connect(shown.url, subprotocols=[Subprotocol("foxglove.sdk.v1")], proxy=None) as socket:
        viewer = Viewer(socket)
        viewer.look(0.5)
        say()
        for frame in frames[10:]:
            live.rover.take_telemetry(frame)
        live.rover.take_images(snapshot)
        live.commands.stop("enough")
        viewer.look(1.0)
        assert {one["topic"] for one in viewer.channels.values()} >= {topic for topic, _, _ in viewer.got}
    live.close()

    (path,) = live.rover.recorder.paths()
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        recorded = {
            channel.topic: (
                channel.message_encoding,
                summary.schemas[channel.schema_id].name,
                summary.schemas[channel.schema_id].encoding,
                summary.schemas[channel.schema_id].data.decode(),
            )
            for channel in summary.channels.values()
        }
        messages = [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]
    advertised = {
        one["topic"]: (one["encoding"], one["schemaName"], one["schemaEncoding"], one["schema"])
        for one in viewer.channels.values()
    }
    assert recorded.items() <= advertised.items()
    assert {"/tf", "/footfall/measured", "/footfall/nav0/right", "/footfall/nav0/left/camera_info"} <= set(recorded)
    later = [one for one in viewer.got if one[0] == "/footfall/frame"]
    assert len(later) == 30
    assert sorted(viewer.got) == sorted(messages)
    topics = {topic for topic, _, _ in viewer.got}
    assert {"/tf", "/footfall/nav0/left", "/footfall/images", "/footfall/to_rover"} <= topics
    assert shown.dropped == 0


def test_it_follows_the_session_that_becomes_current(sessions, shown):
    before = sessions.current
    until(lambda: before.rover.recorder._listeners, "the first session")
    after = sessions.create("another")
    until(lambda: after.rover.recorder._listeners and not before.rover.recorder._listeners, "the next session")


def test_a_port_in_use_is_told(sessions, shown):
    port = int(shown.url.rsplit(":", 1)[1])
    with pytest.raises(Conflict, match="choose another one with --foxglove"):
        FoxgloveServer(sessions, port)
