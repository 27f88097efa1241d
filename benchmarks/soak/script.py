"""What the client of the soak does over REST, and writes down in the ledger as soon as it is answered."""

import json
import threading
import time
from pathlib import Path
from random import Random
from typing import Any

import httpx
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from benchmarks.soak.ledger import Ledger
from benchmarks.soak.processes import until
from footfall.api.access import BASE

SESSION = "/sessions/current"
STEP = 0.06
"""Longest way of a step from where the wheel stood at first, along x and y [m]."""
TRIES = 5
PAUSE = 0.3
"""Before it is tried again [s]: three frames of telemetry."""
PATIENCE = 60.0
"""So long telemetry may speak against a run [s]: many times what it takes to clear a stop over a bad link."""
ENDED = ("done", "failed", "cancelled")


class Interrupted(Exception):
    """Something did not end well: expected of what was killed, an error otherwise."""


class Moved(Interrupted):
    """The gate refused because rover or terrain are not as planned with: telemetry was behind, terrain was loaded."""


class Stale(Interrupted):
    """The gate refused because of what the rover said last: too old (a busy machine), from before a stop was cleared,
    not yet that it has heard of the epoch; or because a bad link was just lost and is made again.
    """


REFUSED = {"start": Moved, "terrain": Moved, "telemetry": Stale, "mode": Stale, "epoch": Stale, "link": Stale}
"""Check of the gate → what its refusal is here."""


class Script:
    """One client. homes: where each wheel stood at first, (x, y) [m]. terrain: a file to load again."""

    def __init__(self, url: str, ledger: Ledger, rng: Random, homes: list[tuple[float, float]], terrain: Path) -> None:
        self.client = httpx.Client(base_url=f"{url}{BASE}", timeout=60, trust_env=False)
        self._ledger, self._rng, self._homes, self._terrain = ledger, rng, homes, terrain
        self._waits = ""
        self._under_way: list[int] = []

    def note(self) -> None:
        """Write one that was never written before."""
        text = f"note {len(self._ledger.asked)}"
        self._ledger.asked.append(text)
        self._post(f"{SESSION}/notes", {"text": text}, 201)
        self._ledger.notes.append(text)

    def load_terrain(self) -> None:
        """The same ground once more; an event all the same."""
        with self._terrain.open("rb") as file:
            self._answered(self.client.post(f"{SESSION}/terrains", files={"file": (self._terrain.name, file)}), 201)

    def plan(self, leg: int | None = None) -> str:
        """Plan a step near the place where the leg stood at first, by a worker; why there is none, or ""."""
        leg = self._rng.randrange(len(self._homes)) if leg is None else leg
        x, y = (at + self._rng.uniform(-STEP, STEP) for at in self._homes[leg])
        self._post(f"{SESSION}/state", {}, 201)
        job = self._post(f"{SESSION}/plans", {"leg": leg, "target": [x, y]}, 202)
        ended = until(lambda: (one := self._get(f"/jobs/{job['id']}"))["state"] in ENDED and one, "the end of a job")
        if ended["state"] != "done":
            raise Interrupted(f"the plan {ended['state']}: {ended['error']}")
        self._ledger.products.append(ended["result"])
        made = self._get(f"{SESSION}/plans/{ended['result']}")
        return "" if made["status"] == "found" else f"leg {leg} to {x:.3f}, {y:.3f}: {made['reason']}"

    def running_job(self) -> str:
        """Id of a job of the session that has not ended, or ""."""
        jobs = self._get(f"{SESSION}/jobs")["jobs"]
        return next((one["id"] for one in jobs if one["state"] not in ENDED), "")

    def cancel(self, job: str) -> None:
        """Cancel it, and wait until it has ended."""
        self._answered(self.client.delete(f"/jobs/{job}"), 202)
        until(lambda: self._get(f"/jobs/{job}")["state"] in ENDED, "the end of a cancelled job")

    def listeners(self) -> list[dict[str, Any]]:
        """Who follows the session's events, and what waits for each."""
        return self._get(f"{SESSION}/listeners")["listeners"]

    def step(self) -> None:
        """Plan, make a sequence, send it, and wait until it is done. First the leg that was under way last."""
        others = self._rng.sample(range(len(self._homes)), len(self._homes))
        for leg in dict.fromkeys([*self._under_way, *others]):
            if reason := self.plan(leg):
                continue
            self._under_way = [leg]
            try:
                self._run(self._post(f"{SESSION}/sequences", {}, 201)["digest"])
            except Moved as moved:  # on a busy machine; from where it stands by now it may go
                reason = str(moved)
                continue
            self._under_way = []
            return
        raise Interrupted(f"no leg can step; {reason}")

    def make_waits(self) -> None:
        """A sequence of which three waits of 0.1 s are left: it can be sent again and again."""
        reason = ""
        for _ in range(TRIES):
            if not (reason := self.plan()):
                break
        else:
            raise Interrupted(reason)
        made = self._post(f"{SESSION}/sequences", {}, 201)
        wait = {"name": "WAIT", "duration": 0.1}
        edits: list[dict[str, Any]] = [{"kind": "insert", "row": 0, "command": wait}] * 3
        edits += [{"kind": "delete", "row": 3}] * len(made["commands"])
        for edit in edits:
            path = f"/sequences/{made['digest']}"
            answer = self.client.patch(path, json={"edit": edit}, headers={"if-match": "*"})
            made = self._answered(answer, 200)
        self._waits = made["digest"]

    def wait_on_rover(self) -> None:
        """Send the waits, and wait until they are done. Made anew where the rover has stepped since."""
        for _ in range(TRIES):
            if not self._waits:
                self.make_waits()
            try:
                return self._run(self._waits)
            except Moved:
                self._waits = ""
        raise Interrupted(f"the rover stood elsewhere, or on other terrain, {TRIES} times")

    def stop(self) -> None:
        """Stop. It is left in force."""
        self._post("/stop", {"reason": "of the soak"}, 200)
        self._ledger.stopped = True

    def clear_stop(self) -> None:
        """Wait for the rover's word and clear the stop."""
        until(lambda: self._get("/stop")["stop_acknowledged"], "the acknowledgement of a stop")
        self._ledger.stopped = False  # from here on the clearing may be what counts, answered or not
        self._post("/stop/clear", {}, 200)

    def settled(self) -> list[str]:
        """What of the latest run is still said to be under way though nothing is; nothing if all is well."""
        about = self._get(SESSION)
        open_yet = [one["id"] for one in about["commands"] if one["state"] in ("sent", "received", "started")]
        return [f"command {one} has no end" for one in open_yet] + (
            ["the gate still sends"] if about["gate"]["state"] == "sending" else []
        )

    def linked(self) -> bool:
        """Whether a rover is there whose telemetry is fresh, and which has confirmed the epoch: it may be commanded."""
        summary = self._get(SESSION)
        link, known = summary["link"], summary["gate"]["epoch_known"]
        return link["connected"] and known and link["age_s"] is not None and link["age_s"] < 0.5

    def stop_in_force(self) -> bool:
        """Whether one is."""
        return self._get("/stop")["stopped"]

    def lets_move(self) -> bool:
        """Whether the gate arms the session's sequence; while a stop is in force it must not."""
        digest = self._get(SESSION)["sequence"]
        return digest is not None and self.client.post(f"/sequences/{digest}/arm").status_code == 200

    def _run(self, digest: str) -> None:
        sent = self._sent(digest)
        self._ledger.runs[sent["run"]] = sent["commands"]
        run = until(
            lambda: (one := self._get(f"{SESSION}/run"))["number"] == sent["run"] and one["ended"] and one,
            "the end of a run",
        )
        if run["outcome"] != "done":
            raise Interrupted(f"run {run['number']} ended: {run['outcome']}, {run['reason']}")

    def _sent(self, digest: str) -> Any:
        """Arm and send; again for a while where newer telemetry may let it: a clearing that got lost is told again."""
        patience = time.monotonic() + PATIENCE
        while True:
            try:
                token = self._post(f"/sequences/{digest}/arm", None, 200)["token"]
                return self._post(f"/sequences/{digest}/send", {"arming": token}, 202)
            except Stale as err:
                if time.monotonic() > patience:
                    raise Interrupted(f"telemetry spoke against it for {PATIENCE:g} s: {err}") from err
                time.sleep(PAUSE)
                until(self.linked, "fresh telemetry", PATIENCE)

    def _get(self, path: str) -> Any:
        return self._answered(self.client.get(path), 200)

    def _post(self, path: str, body: Any, status: int) -> Any:
        return self._answered(self.client.post(path, json=body), status)

    def _answered(self, answer: httpx.Response, status: int) -> Any:
        if answer.status_code == 409 and (kind := REFUSED.get(answer.json().get("check"))):
            raise kind(answer.text)
        if answer.status_code != status:
            raise Interrupted(f"{answer.request.method} {answer.request.url.path}: {answer.text}")
        return answer.json()


class Listener:
    """Hears the events of one life of the server, from the one after the last that was heard."""

    def __init__(self, url: str, session: str, ledger: Ledger) -> None:
        since = max(ledger.heard, default=-1)
        path = f"{BASE}/sessions/{session}/events/line?since={since}&rate=0.1"
        self._address, self._ledger = f"ws{url.removeprefix('http')}{path}", ledger
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Wait for its end: that of the server."""
        self._thread.join()

    def _listen(self) -> None:
        try:
            with connect(self._address, proxy=None) as line:
                for text in line:
                    message = json.loads(text)
                    if message["type"] == "event":
                        self._ledger.hear(message["data"])
        except (OSError, WebSocketException):
            return  # the server has gone
