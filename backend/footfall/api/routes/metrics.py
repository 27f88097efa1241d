"""Figures for Prometheus at ``/metrics``: those of the link, jobs and log are read off when they are asked for."""

import shutil
from collections import Counter as Counted
from collections.abc import Iterator

from fastapi import Request, Response
from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, SummaryMetricFamily
from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from footfall.api.routes.rover import RoverDoor
from footfall.api.routing import Routes, files
from footfall.api.streams import Streams
from footfall.core.errors import CommandRefused
from footfall.core.value import SOFTWARE_VERSION
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions

router = Routes(tags=["health"])

_METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")

_LINK_COUNTS = {
    "frames": "Telemetry frames that came",
    "gaps": "Frames that were missing between those that came, by their numbers",
    "late": "Frames that came again or after newer ones, and were dropped",
    "repeated": "Those of them that came again",
    "restarts": "How often the rover's counting began anew",
    "clock_jumps": "How often the rover's clock went back",
    "acks_again": "Acknowledgements that told nothing new, and were counted alone",
    "lost_on_the_way": "Messages to a rover that was no longer there when they arrived",
}


class Metrics:
    """The figures of one server, in a registry of their own."""

    def __init__(self, sessions: Sessions, streams: Streams, door: RoverDoor) -> None:
        self.registry = CollectorRegistry()
        labels = ["method", "route"]
        self._requests = Counter(
            "footfall_http_requests", "Requests answered", [*labels, "status"], registry=self.registry
        )
        self._seconds = Histogram(
            "footfall_http_request_seconds", "From a request to the end of its answer", labels, registry=self.registry
        )
        self._refusals = Counter(
            "footfall_gate_refusals", "Refusals of the command gate, by check", ["check"], registry=self.registry
        )
        self.registry.register(_Present(sessions, streams, door))
        ProcessCollector(registry=self.registry)  # memory, open files, processor time of the server itself

    def answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count one request; ``route``: its template, never the address itself."""
        method = method if method in _METHODS else "other"
        self._requests.labels(method, route, str(status)).inc()
        self._seconds.labels(method, route).observe(seconds)

    def refused(self, error: CommandRefused) -> None:
        """Count one refusal of the command gate."""
        self._refusals.labels(str(error.details.get("check", "other"))).inc()


class _Present(Collector):
    """What can be read off the sessions at any moment, so that nothing has to be told of changes."""

    def __init__(self, sessions: Sessions, streams: Streams, door: RoverDoor) -> None:
        self._sessions, self._streams, self._door = sessions, streams, door

    def collect(self) -> Iterator[Metric]:
        opened = self._sessions.opened()
        built = GaugeMetricFamily("footfall_build_info", "Always 1", labels=["version"])
        built.add_metric([SOFTWARE_VERSION], 1)
        yield built
        free = shutil.disk_usage(self._sessions.folder).free
        yield GaugeMetricFamily("footfall_disk_free_bytes", "Where the sessions are", free)
        yield from _gate(opened, self._sessions.current)
        yield from _link(opened)
        yield from _log(opened)
        yield from self._jobs()
        listeners = self._streams.listeners()
        yield GaugeMetricFamily("footfall_listeners", "Open event streams", len(listeners))
        slow = sum(one["slow"] for one in listeners)
        yield GaugeMetricFamily("footfall_listeners_slow", "Those that take no message in time", slow)
        text = "Telemetry that gave way to newer before a listener took it"
        yield CounterMetricFamily("footfall_listener_drops", text, self._streams.dropped)
        text = "Listeners that fell too far behind and were let go"
        yield CounterMetricFamily("footfall_listeners_let_go", text, self._streams.let_go)
        bad = CounterMetricFamily("footfall_rover_bad_messages", "Of a rover, that could not be used", labels=["kind"])
        for kind, count in sorted(self._door.kinds.items()):
            bad.add_metric([kind], count)
        yield bad

    def _jobs(self) -> Iterator[Metric]:
        present = GaugeMetricFamily("footfall_jobs", "Jobs that wait or run", labels=["kind", "state"])
        ended = SummaryMetricFamily("footfall_job_seconds", "How long jobs took that ended", labels=["kind", "state"])
        for (kind, state), one in sorted(self._sessions.jobs.tally().items()):
            if state in ("queued", "running"):
                present.add_metric([kind, state], one.count)
            else:
                ended.add_metric([kind, state], one.count, one.seconds)
        yield from (present, ended)


_GATE = {
    "stop_in_force": "Whether a stop is in force",
    "stop_acknowledged": "Whether the rover said that it stands because of it",
    "epoch_confirmed": "Whether the rover has confirmed the present epoch: before, nothing is armed",
    "run_under_way": "Whether a sequence is being sent, or waits",
    "conn_held": "Whether somebody holds the conn",
}


def _gate(opened: list[LiveSession], current: LiveSession | None) -> Iterator[Metric]:
    holds = GaugeMetricFamily("footfall_session_current", "Whether it holds the rover", labels=["session"])
    figures = {name: GaugeMetricFamily(f"footfall_{name}", text, labels=["session"]) for name, text in _GATE.items()}
    commands = GaugeMetricFamily("footfall_commands", "How far commands came", labels=["session", "state"])
    for live in opened:
        holds.add_metric([live.id], live is current)
        gate = live.commands.gate
        now = {
            "stop_in_force": gate["stopped"],
            "stop_acknowledged": gate["stop_acknowledged"],
            "epoch_confirmed": gate["epoch_known"],
            "run_under_way": gate["run"] is not None,
            "conn_held": live.commands.conn["holder"] is not None,
        }
        for name, figure in figures.items():
            figure.add_metric([live.id], now[name])
        for state, count in sorted(Counted(one.state for one in live.state.commands).items()):
            commands.add_metric([live.id, state], count)
    yield from (holds, *figures.values(), commands)


def _link(opened: list[LiveSession]) -> Iterator[Metric]:
    for name, text in _LINK_COUNTS.items():
        counter = CounterMetricFamily(f"footfall_link_{name}", text, labels=["session"])
        for live in opened:
            counter.add_metric([live.id], getattr(live.rover.link, name))
        yield counter
    faults = CounterMetricFamily("footfall_link_faults", "Complaints about the link", labels=["session", "kind"])
    connected = GaugeMetricFamily("footfall_link_connected", "Whether a rover is linked", labels=["session"])
    age = GaugeMetricFamily("footfall_telemetry_age_seconds", "Since the latest frame came", labels=["session"])
    stops = CounterMetricFamily("footfall_stops", "How often a stop was asked for", labels=["session"])
    lost = CounterMetricFamily("footfall_recorder_drops", "What the recorder could not take", labels=["session"])
    for live in opened:
        for kind, count in sorted(live.rover.link.kinds.items()):
            faults.add_metric([live.id, kind], count)
        connected.add_metric([live.id], live.rover.link.connected)
        if (seconds := live.rover.link.age) is not None:
            age.add_metric([live.id], seconds)
        stops.add_metric([live.id], live.rover.stops)
        lost.add_metric([live.id], live.rover.recorder.dropped)
    yield from (faults, connected, age, stops, lost)


def _log(opened: list[LiveSession]) -> Iterator[Metric]:
    text = "How long it took to write events since the session was opened"
    appended = SummaryMetricFamily("footfall_event_append_seconds", text, labels=["session"])
    pending = GaugeMetricFamily("footfall_events_unrecorded", "Events that can't be written yet", labels=["session"])
    for live in opened:
        count, seconds = live.appended
        appended.add_metric([live.id], count, seconds)
        pending.add_metric([live.id], live.unrecorded)
    yield from (appended, pending)


@router.get("/metrics", response_class=Response, responses=files("text/plain"))
def metrics(request: Request) -> Response:
    """The figures of this server, in Prometheus' text form."""
    return Response(generate_latest(request.app.state.metrics.registry), media_type=CONTENT_TYPE_LATEST)
