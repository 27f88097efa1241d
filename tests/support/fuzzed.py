"""The whole REST interface under schemathesis, in this process, over a session that has something of everything."""

import json
import re
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import schemathesis
from argon2 import PasswordHasher
from fastapi import FastAPI
from schemathesis.config import SchemathesisConfig
from schemathesis.engine import events, from_schema

from footfall.api.access import BASE
from footfall.api.assemble import assemble
from footfall.api.door.limits import Limits
from footfall.api.lineage import head_of
from footfall.io.account_store import FILE
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import Identity, Role
from footfall.session.jobs.job import Job
from footfall.session.registry import Sessions
from footfall.terrain.generate import rock_field
from tests.support.kept_workers import KeptWorkers
from tests.support.undeclared import undeclared

CONFIG = """
seed = 20081
base-url = "http://127.0.0.1"
continue-on-failure = true
request-timeout = 60
workers = 1
max-stream-events = 20
headers = {{ {headers} }}

[generation]
max-examples = {examples}
no-shrink = true
deterministic = true
database = "none"

[phases.examples]
enabled = {on[examples]}

[phases.coverage]
enabled = {on[coverage]}
unexpected-methods = ["put", "delete"]

[phases.fuzzing]
enabled = {on[fuzzing]}

[phases.stateful]
enabled = {on[stateful]}
max-steps = 8

# 412: no schema can know the ETag of the present version.
# 422: what is well-formed may still ask for what this robot or this ground does not have; `semantic_refusals` below
# holds that the server then says so by name, and never that the request is malformed.
[checks.positive_data_acceptance]
expected-statuses = ["2xx", "401", "403", "404", "409", "412", "422"]

# 428: what a request without If-Match is refused with (RFC 6585).
[checks.missing_required_header]
expected-statuses = ["400", "401", "403", "422", "428"]

# What is in hand is put down by a DELETE; its address stays, and tells that nothing is.
[[operations]]
include-path = "/api/v1/sessions/{{session}}/hand"
checks.use_after_free.enabled = false
"""


EVERY, CHAINS, EACH = ("examples", "coverage", "fuzzing"), ("stateful",), ("fuzzing",)
"""Phases: every operation by itself, in every way; operations that follow from each other; a few of each."""
NAMES = {Role.VIEWER: "vic", Role.PLANNER: "pia", Role.COMMANDER: "con"}


class CancelledAtOnce(KeptWorkers):
    """A real pool whose long jobs are cancelled as soon as they are accepted; what a request waits for is made."""

    def submit(self, *args: Any, urgent: bool = False, **named: Any) -> Job:
        job = super().submit(*args, urgent=urgent, **named)
        if not urgent:
            job.cancel()
        return job


@dataclass
class Found:
    """What a run found. cases: requests sent; statuses: how they were answered; faults: one line for each kind.

    operations: that were asked; answers: (method, path below the root, status) of each request; after: of each request
    that followed from another the operation before and its own.
    """

    cases: int = 0
    statuses: Counter[int] = field(default_factory=Counter)
    operations: set[str] = field(default_factory=set)
    answers: set[tuple[str, str, int]] = field(default_factory=set)
    after: set[tuple[str, str]] = field(default_factory=set)
    faults: dict[str, str] = field(default_factory=dict)


@contextmanager
def fuzzed_app(folder: Path, accounts: Accounts | None = None) -> Iterator[tuple[FastAPI, dict[str, str]]]:
    """The interface over the sample that has plans and a sequence, and what its paths may name."""
    with Sessions(folder, CancelledAtOnce(workers=1)) as sessions:
        live = sessions.open_sample("rock-step")
        state = live.state
        known = {
            "session": live.id,
            "pair": "nav0",
            "sequence": head_of(live).id,
            "maps": next(iter(state.maps.values())),
            "plans": str(state.plan),
        }
        # a small one: files of terrains are written hundreds of times
        live.terrains.load(rock_field(size=2.0, resolution=0.1, seed=1), "made for the tests")
        known["terrains"] = str(live.state.dem)
        app = assemble(sessions, accounts_=accounts, limits=Limits(requests_per_second=1e6, request_burst=10**6))
        app.state.streams.close()  # event streams end after what is recorded
        yield app, known


@contextmanager
def tokens(folder: Path) -> Iterator[tuple[Accounts, dict[Role, str]]]:
    """Accounts, and a token of each role but an admin's."""
    boss = Identity("boss", Role.ADMIN, "the tests")
    with closing(Accounts(folder / FILE, hasher=PasswordHasher(1, 8, 1))) as accounts:
        accounts.add(boss.name, boss.role, "a long and good one", boss)
        for role, name in NAMES.items():
            accounts.add(name, role, "a long and good one", boss)
        yield accounts, {role: accounts.add_token(f"of-{name}", name, boss) for role, name in NAMES.items()}


def fuzz(
    app: FastAPI, known: dict[str, str], examples: int, phases: tuple[str, ...] = EVERY, token: str | None = None
) -> Found:
    """Every check; four of five path parameters name something that is there. token: of whoever asks."""
    on = {name: str(name in phases).lower() for name in (*EVERY, *CHAINS)}
    headers = {"host": "127.0.0.1"} | ({"authorization": f"Bearer {token}"} if token else {})
    told = ", ".join(f'{name} = "{value}"' for name, value in headers.items())
    config = SchemathesisConfig.from_str(CONFIG.format(examples=examples, on=on, headers=told))
    schema = schemathesis.openapi.from_asgi(f"{BASE}/openapi.json", app, config=config, headers=headers)

    @schema.hook
    def map_path_parameters(context: Any, path_parameters: dict[str, Any] | None) -> dict[str, Any] | None:
        if not path_parameters:
            return path_parameters
        folders = context.operation.path.split("/")
        named = dict(path_parameters)
        for name, given in path_parameters.items():
            chosen = known.get(name) or (known.get(folders[5]) if name == "digest" and len(folders) > 5 else None)
            if chosen is not None and zlib.crc32(str(given).encode()) % 5:
                named[name] = chosen
        return named

    found, document = Found(), app.openapi()
    for event in from_schema(schema).execute():
        if isinstance(event, events.ScenarioFinished):
            _count(found, event.recorder, document)
        elif isinstance(event, (events.NonFatalError, events.FatalError)):
            error = event.value if isinstance(event, events.NonFatalError) else event.exception
            found.faults[f"{type(event).__name__}: {error}"] = ""
    return found


def _count(found: Found, recorder: Any, document: dict[str, Any]) -> None:
    for case, sent in recorder.interactions.items():
        found.cases += 1
        asked = recorder.cases[case]
        operation = asked.value.operation
        found.operations.add(operation.label)
        if asked.parent_id in recorder.cases:
            found.after.add((recorder.cases[asked.parent_id].value.operation.label, operation.label))
        if sent.response is None:
            continue
        found.statuses[sent.response.status_code] += 1
        found.answers.add((asked.value.method, operation.path.removeprefix(BASE), sent.response.status_code))
        semantic_refusals(found, recorder.label, asked.value, sent.response)
        undeclared_members(found, recorder.label, asked.value, sent.response, document)
    for case, checks in recorder.checks.items():
        for check in checks:
            if check.failure_info is not None:
                failure = check.failure_info.failure
                answer = recorder.interactions[case].response if case in recorder.interactions else None
                shown = "" if answer is None else answer.content[:300].decode(errors="replace")
                key = f"{recorder.label}: {check.name}: {failure.title}: {failure.message[:200]}"
                found.faults.setdefault(key, f"{check.failure_info.code_sample[:600]}\n{shown}")


def semantic_refusals(found: Found, label: str, case: Any, answer: Any) -> None:
    """A request that keeps to the schema is never called malformed."""
    positive = case.meta is not None and case.meta.generation.mode.is_positive
    if positive and answer.status_code == 422 and b"/problems/validation" in answer.content:
        shown = answer.content[:400].decode(errors="replace")
        found.faults.setdefault(f"{label}: keeps to the schema, and is called malformed", shown)


def undeclared_members(found: Found, label: str, case: Any, answer: Any, document: dict[str, Any]) -> None:
    """An answer has no member that the document does not tell of."""
    operation = document["paths"].get(case.operation.path, {}).get(case.method.lower(), {})
    told = operation.get("responses", {}).get(str(answer.status_code), {}).get("content", {})
    kind = answer.headers.get("content-type", [""])[0].split(";")[0]
    schema = told.get(kind, {}).get("schema")
    if schema and kind.endswith("json") and answer.content:
        paths = sorted(
            {re.sub(r"\[\d+\]", "[]", one) for one in undeclared(json.loads(answer.content), schema, document)}
        )
        if paths:
            found.faults.setdefault(f"{label}: members that its schema does not tell of: {', '.join(paths)}", "")
