"""Addresses, parameters, bodies and limits of the interface that the documents name are those of its description."""

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from footfall.api.access import BASE
from footfall.api.assemble import assemble
from footfall.api.auth.roles import declared
from footfall.api.door.limits import LIMITS, all_limits
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from tests.support.documents import DOCUMENTS, ROOT, code, spans

METHODS = "GET|POST|PUT|PATCH|DELETE|WS"
BELOW = ("…/", "sessions/", f"{BASE}/", "{side}/")
"""How an address begins that stands without a method."""
WHOLE = re.compile(rf"({METHODS}) (\S+)\s+(\{{.*\}})")
"""A request with its body behind it."""
WITH = re.compile(rf"`({METHODS}) ([^`\s]+)`\s+with\s+`(\{{[^`]*\}})`")
"""A request whose body is told in the next words."""

Operations = dict[tuple[str, str], dict[str, Any]]


@pytest.fixture(scope="module")
def operations(tmp_path_factory: pytest.TempPathFactory) -> Operations:
    """Method and path below the root of the interface → its description, with all schemas that it refers to."""
    with Sessions(tmp_path_factory.mktemp("sessions"), InlineJobs()) as sessions:
        document = json.loads(json.dumps(assemble(sessions).openapi()))
    found = {
        (method.upper(), path.removeprefix(BASE)): {**one, "components": document["components"]}
        for path, methods in document["paths"].items()
        for method, one in methods.items()
    }
    sockets = [route.removeprefix("WS ") for route in declared() if route.startswith("WS ")]
    return {**found, ("GET", "/openapi.json"): {}, **{("WS", path): {} for path in sockets}}


def named(line: str) -> Iterator[tuple[str, str]]:
    """Method ("" where none is told) and address of each operation that a line of code names."""
    yield from re.findall(rf"\b({METHODS}) (\S+)", line.replace("$API", BASE))
    if line.startswith(BELOW):
        yield "", line.split(" ")[0]


def meant(operations: Operations, method: str, address: str) -> list[dict[str, Any]]:
    """The operations that an address may mean; its beginning may be left out with ``…``."""
    path = address.partition("?")[0].removeprefix(BASE)
    wanted = path.removeprefix("…").strip("/").split("/")
    shortened = path.startswith((BELOW[0], BELOW[-1]))
    return [
        one
        for (by, real), one in operations.items()
        if method in ("", by) and _same(wanted, real.strip("/").split("/"), shortened)
    ]


def _same(wanted: list[str], real: list[str], shortened: bool) -> bool:
    """Whether the parts of an address are those of a path, or of its end."""
    if len(wanted) > len(real) or (len(wanted) < len(real) and not shortened):
        return False
    real = real[-len(wanted) :]
    if shortened and real[0].startswith("{") and real[0] != wanted[0]:
        return False
    patterns = [re.sub(r"\\\{\w+\\\}", "[^/]+", re.escape(part)) for part in real]
    return all(re.fullmatch(pattern, part) for pattern, part in zip(patterns, wanted, strict=True))


def test_every_address_is_one(operations: Operations) -> None:
    wrong, count = [], 0
    for document in DOCUMENTS:
        for method, address in (one for line in code(document.read_text("utf-8")) for one in named(line)):
            count += 1
            asked = set(re.findall(r"[?&](\w+)=", address))
            taken = [
                {one["name"] for one in found.get("parameters", ())} for found in meant(operations, method, address)
            ]
            if not any(asked <= names for names in taken):
                wrong.append((document.name, method, address))
    assert count > 80
    assert wrong == []


def bodies() -> Iterator[tuple[str, str, str, Any]]:
    """Document, method, address and body of each request that a document tells whole."""
    for document in DOCUMENTS:
        text = document.read_text("utf-8")
        told = [one.groups() for line in code(text) if (one := WHOLE.fullmatch(line))] + WITH.findall(text)
        for method, address, body in told:
            try:
                yield document.name, method, address, json.loads(body.replace("DIGEST", f'"{32 * "0"}"'))
            except ValueError:
                assert re.search("…|before", body), (document.name, body)


def test_every_body_may_be_sent(operations: Operations) -> None:
    told = list(bodies())
    assert len(told) > 14
    for document, method, address, body in told:
        (found,) = meant(operations, method, address)
        schema = found["requestBody"]["content"]["application/json"]["schema"]
        against = Draft202012Validator({**schema, "components": found["components"]}).iter_errors(body)
        assert [one.message for one in against] == [], (document, method, address)


def test_the_table_of_limits_has_all_of_them() -> None:
    text = (ROOT / "docs/api.md").read_text("utf-8").partition("`GET info` lists them under `limits`.")[2]
    rows = [line.split("|")[1] for line in text.partition("\n\nA body")[0].splitlines() if line.startswith("| `")]
    assert sorted(name for row in rows for name in spans(row)) == sorted(all_limits(LIMITS, None))


@pytest.mark.parametrize(
    ("method", "address", "there"),
    [
        ("GET", "…/walks/{digest}/along", True),
        ("GET", "…/walks/{digest}/across", False),
        ("POST", "…/walk-loop/hold", True),
        ("POST", "…/no-such", False),
        ("PATCH", "sessions/{id}", True),
        ("PUT", "sessions/{id}", False),
        ("", "…/queues/current", True),
        ("", "{side}/at?u=&v=", True),
        ("WS", "sessions/{id}/events/line", True),
        ("GET", f"{BASE}/recordings/{{session}}.html", True),
    ],
)
def test_an_address_is_found(operations: Operations, method: str, address: str, there: bool) -> None:
    assert bool(meant(operations, method, address)) == there
