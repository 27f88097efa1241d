"""Members of an answer that its schema does not name: JSON Schema lets them pass, and nobody is told of them."""

from typing import Any


def undeclared(answer: Any, schema: dict[str, Any], document: dict[str, Any], at: str = "") -> list[str]:
    """Paths of members of ``answer`` that ``schema``, of an OpenAPI ``document``, does not tell of."""
    while "$ref" in schema:
        schema = _found(schema["$ref"], document)
    choices = schema.get("anyOf") or schema.get("oneOf")
    if choices:
        found = [undeclared(answer, one, document, at) for one in choices if _may_be(answer, one, document)]
        return min(found, key=len, default=[])
    if isinstance(answer, dict):
        return _of_members(answer, schema, document, at)
    if isinstance(answer, list):
        items = schema.get("prefixItems") or [schema.get("items") or {}] * len(answer)
        pairs = enumerate(zip(answer, items, strict=False))
        return [path for i, (one, item) in pairs for path in undeclared(one, item, document, f"{at}[{i}]")]
    return []


def _of_members(answer: dict[str, Any], schema: dict[str, Any], document: dict[str, Any], at: str) -> list[str]:
    members, others = schema.get("properties"), schema.get("additionalProperties")
    found: list[str] = []
    for name, item in answer.items():
        path = f"{at}.{name}" if at else name
        if members is not None and name in members:
            found += undeclared(item, members[name], document, path)
        elif isinstance(others, dict):
            found += undeclared(item, others, document, path)
        elif members is not None and not others:
            found.append(path)
    return found


def _found(reference: str, document: dict[str, Any]) -> dict[str, Any]:
    found: Any = document
    for step in reference.removeprefix("#/").split("/"):
        found = found[step]
    return found


def _may_be(answer: Any, schema: dict[str, Any], document: dict[str, Any]) -> bool:
    while "$ref" in schema:
        schema = _found(schema["$ref"], document)
    kinds = schema.get("type")
    if kinds is None:
        return True
    own = {dict: "object", list: "array", str: "string", bool: "boolean", type(None): "null"}.get(
        type(answer), "number"
    )
    return own in kinds or (own == "number" and "integer" in kinds)
