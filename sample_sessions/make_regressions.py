"""Makes the regression corpus anew: ``python sample_sessions/make_regressions.py [NAME…]``.

Each is a small session or recording that FootFall once got wrong; sample_sessions/regressions/README.md says what went
wrong, tests/samples/test_regressions.py what must come out. The rover is simulated or, in the recording, made up.
"""

import hashlib
import io
import json
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from footfall.processor import LATE, choose_arithmetic  # isort: skip (it comes before numpy)

import numpy as np

import footfall
from footfall.io.bundles import read_bundle, write_zip
from footfall.io.event_log import rechain
from footfall.io.recordings import TO_ROVER
from footfall.io.recordings.writing import RecordingWriter
from footfall.planning.answers import Status
from footfall.session.access.acting import acting
from footfall.session.access.identity import LOCAL
from footfall.session.jobs.local import InlineJobs
from footfall.session.live import LiveSession
from footfall.session.registry import Sessions
from footfall.session.rover.recorder import acknowledgement
from footfall.telemetry.link import CommandMessage, StopMessage, message_object
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.generate import fractal

HERE = Path(__file__).resolve().parent / "regressions"
HALF = r"\ud800"
"""Half a character, as JSON spells it."""


def stood(session: LiveSession) -> RobotState:
    """A rover on small ground, which the session shows."""
    world = fractal(size=6.0, resolution=0.06, roughness=0.02, hurst=0.9, seed=12)
    state = footfall.stand(session.robot, world)
    session.terrains.load(world, "fractal ground")
    session.stances.set(state)
    return state


def legs_in_each_other(sessions: Sessions) -> bytes:
    session = sessions.create("A start whose standing legs cut each other")
    state = stood(session)
    posture = np.array(state.posture)
    posture[12] += 0.95
    posture[18] -= 0.95
    session.stances.set(replace(state, posture=posture))
    session.maps.choose_footfall(0, 2.0, 0.4)
    session.plans.step().finish()
    if session.state.plan_status != Status.START_INVALID.value:
        sys.exit(f"{session.name}: {session.state.plan_status}, {session.state.plan_reason}")
    return session.export_bundle()


def stop_carried_along(sessions: Sessions) -> bytes:
    with acting(LOCAL):
        sessions.create("Before").commands.stop("dust storm")
        session = sessions.create("A session that began under a stop")
    stood(session)
    session.add_note("The rover stands; nobody cleared the stop of the session before.")
    return session.export_bundle()


def half_a_character(sessions: Sessions) -> bytes:
    """As versions wrote it that let such text in: the chain of the log made anew over it."""
    session = sessions.create("Cameras HALF")
    session.add_note("cold HALF cameras")
    session.rover.take_complaint("fault HALF", about_rover="other")
    with zipfile.ZipFile(io.BytesIO(session.export_bundle())) as bundle:
        files = {name: bundle.read(name).replace(b"HALF", HALF.encode()) for name in bundle.namelist()}
    previous, lines = "0" * 32, []
    for line in files["events.jsonl"].splitlines():
        body = {name: member for name, member in json.loads(line).items() if name != "hash"} | {"previous": previous}
        told = json.dumps(body, sort_keys=True, separators=(",", ":")).encode()
        previous = hashlib.sha256(told).hexdigest()[:32]
        lines.append(json.dumps({**body, "hash": previous}).encode())
    about = json.loads(files["session.json"])
    about["head"]["hash"] = previous
    files |= {"events.jsonl": b"\n".join(lines) + b"\n", "session.json": json.dumps(about).encode()}
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as changed:
        for name, content in files.items():
            changed.writestr(name, content)
    return out.getvalue()


def endless_run(sessions: Sessions) -> bytes:
    """As nobody's software writes it, with a chain that holds: a run of more rows than any memory has room for."""
    session = sessions.create("A run without end")
    session.add_note("The next event says that 2^63 rows are sent.")
    read = read_bundle(session.export_bundle())
    run = {"run": 1, "sequence": "0" * 32, "rows": 2**63, "mode": "whole"}
    last = {"seq": len(read.records), "time": read.records[-1]["time"], "type": "run_started", "payload": run}
    records = rechain([*read.records, {**last, "previous": "", "hash": ""}])
    head = {"seq": len(records) - 1, "hash": records[-1]["hash"]}
    return write_zip(replace(read, records=records, session={**read.session, "head": head}))


def cut_short(sessions: Sessions) -> bytes:
    """A recording whose writer was killed: numbers jump, the rover restarts, a stop goes out, no end was written."""
    session = sessions.create("of the recording")
    state = stood(session)
    out = io.BytesIO()
    writer = RecordingWriter(out, session.robot.joint_names, {"robot": "athlete", "legs": "6", "session": "cut"})
    for i, number in enumerate([*range(20), *range(25, 40), *range(15)]):
        at = replace(state, time=0.1 * i)
        writer.frame(TelemetryFrame(number, at, np.array(state.posture)), i * 100_000_000)
    writer.note(TO_ROVER, message_object(CommandMessage("a", "s" * 32, 0, "wait", None, None, 1.0)), 5_000_000_000)
    for known in ("received", "started"):
        writer.note(*acknowledgement("ack", "a", known), 5_100_000_000)
    writer.note(TO_ROVER, message_object(StopMessage("s1")), 5_200_000_000)
    writer.flush()
    return out.getvalue()


CORPUS: dict[str, Callable[[Sessions], bytes]] = {
    "legs-in-each-other.zip": legs_in_each_other,
    "stop-carried-along.zip": stop_carried_along,
    "half-a-character.zip": half_a_character,
    "endless-run.zip": endless_run,
    "cut-short.mcap.part": cut_short,
}


def main(names: list[str]) -> None:
    if not choose_arithmetic():
        sys.exit(LATE)
    for name in names or list(CORPUS):
        with tempfile.TemporaryDirectory() as work, Sessions(Path(work), jobs=InlineJobs(), recording=None) as sessions:
            content = CORPUS[name](sessions)
        (HERE / name).write_bytes(content)
        print(f"{name}: {len(content) / 1e3:.1f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
