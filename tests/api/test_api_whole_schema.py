"""schemathesis over every operation of the OpenAPI document, with every check that it has, finds nothing."""

import sys

import pytest

from tests.support.fuzzed import fuzz, fuzzed_app

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
