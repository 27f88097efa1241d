"""The OpenAPI document is complete: ids, descriptions, schemas of every answer, every refusal, closed requests."""

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from footfall.api.assemble import assemble
from footfall.api.bodies.answer_models import answer_model
from footfall.api.bodies.jsonable import jsonable
from footfall.api.bodies.schemas import MapOrder, StepSettingsModel
from footfall.planning.step.problem import StepSettings
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions

UNSAID = {"description", "title", "default", "examples", "example"}


@pytest.fixture(scope="module")
def document(tmp_path_factory) -> dict[str, Any]:
    with Sessions(tmp_path_factory.mktemp("sessions"), InlineJobs()) as sessions:
        return json.loads(json.dumps(assemble(sessions).openapi()))


def _operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield f"{method} {path}", operation


def test_every_operation_has_an_id_of_its_own_and_says_what_it_does(document):
    ids = [operation["operationId"] for _, operation in _operations(document)]
    assert len(set(ids)) == len(ids)
    for name, operation in _operations(document):
        assert re.fullmatch(r"[a-z_]+", operation["operationId"]), name
        assert operation["summary"], name
        assert operation["description"], name
        for parameter in operation.get("parameters", ()):
            about = parameter.get("description") or parameter["schema"].get("title")
            assert about, (name, parameter["name"])


def test_every_answer_has_a_schema(document):
    for name, operation in _operations(document):
        good = {status: one for status, one in operation["responses"].items() if status[0] == "2" and status != "204"}
        assert good or {"204", "303"} & set(operation["responses"]), name
        for status, answer in good.items():
            assert answer["content"], (name, status)
            for media, content in answer["content"].items():
                assert set(content.get("schema", content.get("itemSchema", {}))) - UNSAID, (name, status, media)


def test_every_refusal_is_a_problem_document(document):
    for name, operation in _operations(document):
        refusals = {status: one for status, one in operation["responses"].items() if status[0] in "45"}
        assert {"401", "403", "429", "500", "503"} <= set(refusals), name
        assert ("404" in refusals) >= ("{" in name), name
        assert ("413" in refusals) == ("requestBody" in operation), name
        for one in refusals.values():
            component = document["components"]["responses"][one["$ref"].rsplit("/", 1)[1]]
            assert list(component["content"]) == ["application/problem+json"]


def test_every_reference_leads_somewhere(document):
    for reference in set(re.findall(r'"\$ref": "([^"]+)"', json.dumps(document))):
        found = document
        for part in reference.removeprefix("#/").split("/"):
            found = found[part]
    for schema in document["components"]["schemas"].values():
        Draft202012Validator.check_schema(schema)


def test_requests_are_closed(document):
    """No object of a request takes a member that it does not know; those with names of their own tell their type."""
    for name, operation in _operations(document):
        if name.endswith(" /api/v1/stop"):
            continue  # no mistake in its body keeps a rover going
        for content in operation.get("requestBody", {}).get("content", {}).values():
            for schema in _objects(content["schema"], document):
                assert schema.get("additionalProperties", True) is not True, (name, schema.get("title"))


def _objects(schema: Any, document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if isinstance(schema, list):
        for one in schema:
            yield from _objects(one, document)
    elif isinstance(schema, dict):
        if "$ref" in schema:
            yield from _objects(document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]], document)
        if schema.get("type") == "object":
            yield schema
        for name, one in schema.items():
            if name not in UNSAID:
                yield from _objects(one, document)


@pytest.mark.parametrize("number", ["true", '"2"', "2.5", "NaN", "Infinity", "-1", "64", "null", "[2]"])
def test_numbers_are_numbers(number):
    with pytest.raises(ValueError, match="leg"):
        MapOrder.model_validate_json(f'{{"leg": {number}}}')


def test_a_whole_number_may_be_written_with_a_point():
    assert MapOrder.model_validate_json('{"leg": 2.0}').leg == 2
    with pytest.raises(ValueError, match="conservative"):
        StepSettingsModel.model_validate_json('{"conservative": 1}')


def test_a_value_is_told_as_it_is_written():
    told = answer_model(StepSettings).model_json_schema(mode="serialization")
    Draft202012Validator(told).validate(jsonable(StepSettings()))
    assert set(told["required"]) == set(jsonable(StepSettings()))


def test_forms_tell_how_many_files_they_take(document):
    forms = [
        content["multipart/form-data"]["schema"]["properties"]
        for methods in document["paths"].values()
        for operation in methods.values()
        if "multipart/form-data" in (content := operation.get("requestBody", {}).get("content", {}))
    ]
    several = [one for form in forms for one in form.values() if one.get("type") == "array"]
    assert len(several) >= 5
    assert all(1 <= one["maxItems"] <= 1000 for one in several)
