"""A live Foxglove WebSocket: what the recordings hold, at the moment when it comes, for whoever looks on.

The channels and their schemas are those of the recordings (docs/recordings.md). Nothing comes in this way. A
thread of its own writes and sends; where it can't keep up, the oldest is dropped and counted.
"""

import contextlib
import logging
import queue
import threading
from collections.abc import Callable

import foxglove
from foxglove import Channel, Context, Schema

from footfall.core.errors import Conflict, FootFallError
from footfall.io.recordings.messages import Written, form_of, of_frame, of_images, of_object, topics
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.session.rover.recorder import Item
from footfall.telemetry.images import Snapshot
from footfall.telemetry.state import TelemetryFrame

DEFAULT_PORT = 8765
"""Where Foxglove looks of itself."""
LOOK_PERIOD = 0.2
"""How often it looks whether another session has become current [s]."""
LONGEST_QUEUE = 64
"""Things that wait to be sent; beyond that the oldest is dropped."""
_log = logging.getLogger(__name__)


class FoxgloveServer:
    """Shows the current one of ``sessions`` on ``ws://127.0.0.1:port`` (0: a free one) until it is closed.

    dropped: things that could not be shown in time. Raises Conflict where the port can't be used.
    """

    def __init__(self, sessions: Sessions, port: int = DEFAULT_PORT) -> None:
        self._sessions = sessions
        self._waiting: queue.Queue[tuple[LiveSession, Item, int]] = queue.Queue(LONGEST_QUEUE)
        self._context = Context()
        self._channels: dict[str, Channel] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="foxglove", daemon=True)
        self.dropped = 0
        try:
            self._server = foxglove.start_server(name="FootFall", host="127.0.0.1", port=port, context=self._context)
        except Exception as error:
            raise Conflict(
                f"the Foxglove server can't use port {port} ({error}); choose another one with --foxglove", port=port
            ) from error
        self._thread.start()

    @property
    def url(self) -> str:
        """Where it listens."""
        return f"ws://127.0.0.1:{self._server.port}"

    def close(self) -> None:
        """End it, and every connection to it; harmless when done twice."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            self._server.stop()
            for channel in self._channels.values():
                channel.close()

    def _run(self) -> None:
        shown: LiveSession | None = None
        unlisten: Callable[[], None] = _nothing
        while not self._ended.is_set():
            live = self._sessions.current
            if live is not None and live is not shown:
                unlisten()
                shown, unlisten = live, live.rover.recorder.listen(self._take(live))
                self._server.clear_session(live.id)
                self._advertise(live)
            with contextlib.suppress(queue.Empty):
                self._show(*self._waiting.get(timeout=LOOK_PERIOD))
        unlisten()

    def _advertise(self, live: LiveSession) -> None:
        """At once, not with the first message: a viewer that subscribes in the same moment would not be heard."""
        cameras = (live.described or live.description).cameras
        for topic, kind in topics(len(live.layout.legs), tuple(camera.name for camera in cameras)).items():
            self._channel(topic, kind)

    def _take(self, live: LiveSession) -> Callable[[Item, int], None]:
        def take(item: Item, at: int) -> None:
            while True:
                try:
                    return self._waiting.put_nowait((live, item, at))
                except queue.Full:
                    with contextlib.suppress(queue.Empty):
                        self._waiting.get_nowait()
                        self.dropped += 1

        return take

    def _show(self, live: LiveSession, item: Item, at: int) -> None:
        try:
            for message in _written(live, item):
                self._channel(message.topic, message.kind).log(message.data, log_time=at)
        except FootFallError as error:
            _log.warning("something can't be shown in Foxglove: %s", error.message)

    def _channel(self, topic: str, kind: str) -> Channel:
        if topic not in self._channels:
            form = form_of(kind)
            schema = Schema(name=form.name, encoding=form.schema_encoding, data=form.schema)
            self._channels[topic] = Channel(topic, schema=schema, message_encoding=form.encoding, context=self._context)
        return self._channels[topic]


def _written(live: LiveSession, item: Item) -> list[Written]:
    match item:
        case TelemetryFrame():
            return of_frame(item, live.layout.joint_names)
        case Snapshot():
            return of_images(item)
        case (topic, body):
            return of_object(topic, body)


def _nothing() -> None:
    """No session is listened to yet."""
