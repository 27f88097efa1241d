"""Recompute every product of a session from its recorded parents, and compare.

No browser, rover or server is needed: the recipes are those of the live session. What a session was told
(states, images, terrain files, settings) is read, verified and believed; what it computed is not.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from footfall.core.errors import Cancelled, FootFallError, InvalidBundle
from footfall.core.interrupted import came_of_interrupt
from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Value
from footfall.io.artifacts import decode
from footfall.io.bundles import ARTIFACTS, Bundle
from footfall.maps.layers import MapStack
from footfall.maps.refusals import NOT_PROVEN
from footfall.planning.answers import Status
from footfall.planning.walk.problem import WalkResult
from footfall.planning.watch import patience
from footfall.processor import LATE, choose_arithmetic
from footfall.session.jobs.product_recipes import PRODUCTS, Recipe, make
from footfall.session.log.event import event_of
from footfall.session.log.fold import SessionState, fold_all
from footfall.session.replay.compare import differences
from footfall.session.storage.artifact_folder import bytes_digest, verify_artifact
from footfall.session.storage.store import read_session

EQUAL_WITHIN = 1e-9
"""Floats that differ by at most this come from another processor, not from another computation; see
:mod:`footfall.processor`."""

PATIENCE = 20.0
"""Times its time limit that a search may take in a replay, where it ended by itself when it was recorded."""

VERDICTS = ("same", "equal_within", "not_reproducible", "unchecked", "different", "missing", "failed")


@dataclass(frozen=True)
class ProductReport:
    """One product.

    verdict: "same" (equal to the last bit), "equal_within" (floats differ by at most EQUAL_WITHIN),
    "not_reproducible" (a search that ended by its time limit), "unchecked" (only read), "different",
    "missing" (the product or something it was made from is not there or damaged), "failed" (the recipe raised).
    difference: path of the first field that differs; magnitude: largest |difference| of all fields.
    """

    seq: int
    kind: str
    recorded: str
    recomputed: str | None
    verdict: str
    difference: str | None
    magnitude: float | None
    text: str

    @property
    def ok(self) -> bool:
        """Whether nothing speaks against the product."""
        return self.verdict in VERDICTS[:4]


@dataclass(frozen=True)
class ReplayReport:
    """What a replay found. problems: damage of the bundle that no single product stands for."""

    name: str
    events: int
    state: SessionState | None
    products: tuple[ProductReport, ...]
    problems: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether the session is whole and every product came out as recorded."""
        return not self.problems and all(product.ok for product in self.products)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON."""
        return {
            "name": self.name,
            "ok": self.ok,
            "events": self.events,
            "products": [{f: getattr(p, f) for f in ProductReport.__dataclass_fields__} for p in self.products],
            "problems": list(self.problems),
        }

    def lines(self) -> list[str]:
        """What was found, for people."""
        found = [
            f"{p.kind:<9} {p.recorded[:12]}  {p.verdict}" + (f": {p.text}" if p.text else "") for p in self.products
        ]
        return [*found, *(f"problem: {text}" for text in self.problems)]

    def summary(self) -> str:
        """All of it in one line."""
        return f"{self.events} events, {len(self.products)} products, {'the same' if self.ok else 'NOT the same'}"


def replay(
    bundle: str | os.PathLike[str] | bytes,
    check: bool = True,
    progress: Progress = no_progress,
    recipes: Mapping[str, Recipe] = PRODUCTS,
) -> ReplayReport:
    """Replay a session and compare what comes out with what was recorded.

    Args:
        bundle: a folder, a zip file, the bytes of a zip, or the folder of a session in a working folder.
        check: whether every product is recomputed; else the log is only folded and the files are verified.
        progress: called with a fraction 0…1 and a text; may raise Cancelled.
        recipes: kind of product → what computes it; as delivered, those of FootFall.

    Returns:
        What each product came out as; of a session that can't be read at all a report with that problem.

    Raises:
        Cancelled: ``progress`` raised it.
    """
    name = "bundle" if isinstance(bundle, bytes) else os.path.basename(os.fspath(bundle).rstrip("/"))
    try:
        read = read_session(bundle)
        state = fold_all(event_of(record) for record in read.records)
    except InvalidBundle as err:
        return ReplayReport(name, 0, None, (), (err.message,))
    name = state.name or name
    problems = [f"the log ends with a torn line of {read.torn} bytes"] if read.torn else []
    problems += _damaged(read, part(progress, 0.0, 0.1))
    made = [record for record in read.records if record["type"] == "product"]
    reports: list[ProductReport] = []
    for i, record in enumerate(made):
        kind = record["payload"]["kind"]
        span = part(progress, 0.1 + 0.9 * i / len(made), 0.1 + 0.9 * (i + 1) / len(made))
        span(0.0, f"{kind}, {i + 1} of {len(made)}")
        reports.append(_Replayed(read, record, check, recipes, span).report())
    progress(1.0, "done")
    return ReplayReport(name, len(read.records), state, tuple(reports), tuple(problems))


def _damaged(read: Bundle, progress: Progress) -> list[str]:
    """Damaged files, and inputs that events name but nobody stored."""
    problems = []
    for i, (name, content) in enumerate(read.files.items()):
        progress(i / len(read.files), f"reading {name}")
        try:
            verify_artifact(name, content())
        except InvalidBundle as err:
            problems.append(err.message)
    for record in read.records:
        payload = record["payload"]
        named = {
            "session_created": ["robot"],
            "state_frozen": ["digest"],
            "snapshot_taken": ["digest", "state"],
            "terrain_loaded": ["digest"],
        }.get(record["type"], [])
        problems += [
            f"{ARTIFACTS}/{payload[key]}.npz is missing; event {record['seq']} ({record['type']}) names it"
            for key in named
            if f"{payload[key]}.npz" not in read.files
        ]
    return problems


class _Replayed:
    """One product being replayed."""

    def __init__(
        self, read: Bundle, record: Mapping[str, Any], check: bool, recipes: Mapping[str, Recipe], progress: Progress
    ) -> None:
        self.read, self.check, self.recipes, self.progress = read, check, recipes, progress
        self.seq = record["seq"]
        self.payload = record["payload"]
        self.kind, self.digest = self.payload["kind"], self.payload["digest"]

    def report(self) -> ProductReport:
        try:
            recorded = self._stored(self.digest)
            parents = {name: self._value(digest) for name, digest in self.payload["parents"].items()}
            asked = self.payload["settings"]
            settings = None if asked is None else self._value(asked)
        except InvalidBundle as err:
            return self._say("missing", None, err.message)
        if not self.check:
            return self._say("unchecked", None, "read, not recomputed")
        try:
            with patience(1.0 if _timed_out(recorded) else PATIENCE):
                product = make(self.recipes, self.kind, parents, settings, self.progress)
        except Cancelled:
            raise
        except FootFallError as err:
            return self._say("failed", None, f"{err.kind}: {err.message}")
        except Exception as err:
            if came_of_interrupt(err):
                raise KeyboardInterrupt from err
            return self._say("failed", None, f"{type(err).__name__}: {err}")
        return self._compare(recorded, product)

    def _compare(self, recorded: Value | bytes, product: Value | bytes) -> ProductReport:
        digest = bytes_digest(product) if isinstance(product, bytes) else product.digest
        if digest == self.digest:
            return self._say("same", digest, "")
        found = list(differences(recorded, product))
        if not found:
            return self._say("same", digest, "equal in every field")
        sizes = [one.magnitude for one in found]
        magnitude = None if any(size is None for size in sizes) else max(size for size in sizes if size is not None)
        first = found[0]
        timed_out = [
            when
            for when, result in (("when it was recorded", recorded), ("in this replay", product))
            if _timed_out(result)
        ]
        if timed_out:
            # How far it comes in its time depends on the machine and on what else runs there.
            verdict = "not_reproducible" if timed_out[0] == "when it was recorded" else "different"
            text = f"it ran into its time limit {' and '.join(timed_out)}, so the two need not agree"
        elif magnitude is not None and magnitude <= EQUAL_WITHIN:
            verdict, text = "equal_within", f"{len(found)} fields differ by at most {magnitude:.3g}"
        else:
            late = "" if choose_arithmetic() else f"; {LATE}"
            verdict, text = "different", f"{first.path}: {first.text}{late}"
        return ProductReport(self.seq, self.kind, self.digest, digest, verdict, first.path, magnitude, text)

    def _say(self, verdict: str, recomputed: str | None, text: str) -> ProductReport:
        return ProductReport(self.seq, self.kind, self.digest, recomputed, verdict, None, None, text)

    def _value(self, digest: str) -> Value:
        name = f"{digest}.npz"
        if name not in self.read.files:
            raise InvalidBundle(f"{ARTIFACTS}/{name} is missing", file=f"{ARTIFACTS}/{name}")
        return decode(self.read.files[name](), expect=digest, name=f"{ARTIFACTS}/{name}")

    def _stored(self, digest: str) -> Value | bytes:
        for name in self.read.files:
            if name.startswith(f"{digest}.") and not name.endswith(".npz"):
                data = self.read.files[name]()
                verify_artifact(name, data)
                return data
        return self._value(digest)


def _timed_out(result: Value | bytes) -> bool:
    """Whether a search, a walk's smoothing, or maps that are made cell by cell, ended by a time limit."""
    if isinstance(result, MapStack):
        return bool((result.layers.get("refused_by", np.zeros(0)) == NOT_PROVEN).any())
    if isinstance(result, WalkResult) and result.smoothed is not None and result.smoothed.cut_short:
        return True
    return getattr(result, "status", None) is Status.TIME_LIMIT
