"""schemathesis over every operation of the OpenAPI document, with every check that it has, finds nothing."""

import sys

import pytest

from footfall.api.auth.roles import allows, needed
from footfall.session.access.identity import Identity, Role
from tests.support.fuzzed import CHAINS, EACH, NAMES, fuzz, fuzzed_app, tokens

LEAST_CASES = 2000


@pytest.mark.long
def test_schemathesis_finds_nothing(tmp_path, capsys):
    with fuzzed_app(tmp_path) as (app, known):
        operations = sum(len(methods) for methods in app.openapi()["paths"].values())
        found = fuzz(app, known, examples=2)
    with capsys.disabled():
        sys.stdout.write(f" {found.cases} cases over {len(found.operations)} operations: {dict(found.statuses)} ")
    assert not found.faults, "\n\n".join(f"{what}\n{sent}" for what, sent in found.faults.items())
    assert len(found.operations) == operations
    assert found.cases >= LEAST_CASES
    assert found.statuses[200] >= 200  # it went past the doors


@pytest.mark.long
def test_schemathesis_finds_nothing_in_chains_of_requests(tmp_path, capsys):
    """What one operation answers is what the next one asks about."""
    with fuzzed_app(tmp_path) as (app, known):
        found = fuzz(app, known, 60, CHAINS)
    with capsys.disabled():
        sys.stdout.write(f" {found.cases} cases, {len(found.after)} pairs of operations: {dict(found.statuses)} ")
    assert not found.faults, "\n\n".join(f"{what}\n{sent}" for what, sent in found.faults.items())
    # how long chains get depends on when jobs end: 47 pairs alone on a computer, 27 beside other tests
    assert len(found.after) >= 15
    assert sum(count for status, count in found.statuses.items() if 200 <= status < 300) >= found.cases / 10


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    """One app with accounts for all roles: what it makes for the first that asks it need not make again."""
    folder = tmp_path_factory.mktemp("guarded")
    with tokens(folder) as (accounts, of), fuzzed_app(folder / "sessions", accounts) as (app, known):
        yield app, known, of


@pytest.mark.long
@pytest.mark.parametrize("role", NAMES)
def test_schemathesis_finds_nothing_where_there_are_accounts(guarded, role):
    app, known, of = guarded
    found = fuzz(app, known, 1, EACH, of[role])
    assert not found.faults, "\n\n".join(f"{what}\n{sent}" for what, sent in found.faults.items())
    who = Identity(NAMES[role], role)
    # what makes no sense is refused as such to anybody
    may = {(method, path) for method, path, status in found.answers if status not in (400, 401, 403)}
    refused = {(method, path) for method, path, status in found.answers if status == 403}
    assert all(allows(needed(method, path) or Role.ADMIN, who, None) for method, path in may)
    assert not any(allows(needed(method, path) or Role.ADMIN, who, None) for method, path in refused)
    assert min(len(may), len(refused)) >= 5
