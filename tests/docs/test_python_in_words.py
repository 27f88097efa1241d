"""Python that the documents name is there: what ``footfall`` has, how it is called, fields of settings and values."""

import ast
import inspect
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import footfall
from footfall.planning.any_robot import ByRobot
from tests.support.documents import DOCUMENTS, ROOT, code, lines_of_code, spans

NO_MODULES = {
    "footfall.sqlite": "the database in the data folder",
    "footfall.seen_by": "of the overlay of an image, `footfall`",
}
OF_OTHERS = {"camera_calibration", "data_checksums", "pg_amcheck"}
"""Names of ROS and PostgreSQL."""
NAMED_FOR = ("Settings", "Limits", "Weights", "Sizes", "Costs")
"""How classes end whose name alone is looked for."""


@cache
def classes() -> dict[str, set[str]]:
    """Class → its fields, methods, and what it is made with; of those of the same name together."""
    found: dict[str, set[str]] = {}
    for folder in ("backend/footfall", "training"):
        for path in (ROOT / folder).rglob("*.py"):
            for one in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(one, ast.ClassDef):
                    found.setdefault(one.name, set()).update(_members(one))
    return found


def _members(one: ast.ClassDef) -> Iterator[str]:
    for part in one.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            yield part.target.id
        if isinstance(part, ast.FunctionDef):
            yield part.name
            if part.name == "__init__":
                yield from (each.arg for each in (*part.args.args, *part.args.kwonlyargs))


def calls(line: str) -> Iterator[ast.Call]:
    """The calls in a line of Python; none where it is something else. ``…``, what is left out, is no argument."""
    text = re.sub(r", …", "", line).replace("…", "...")
    try:
        tree = ast.parse(text)
    except SyntaxError:
        return
    yield from (one for one in ast.walk(tree) if isinstance(one, ast.Call))


def is_there(dotted: str) -> bool:
    """Whether a name that begins with ``footfall`` is a module, or something in one."""
    above, _, name = dotted.rpartition(".")
    try:
        return find_spec(dotted) is not None or hasattr(import_module(above), name)
    except ModuleNotFoundError:
        return False


def takes(function: Any, call: ast.Call) -> bool:
    """Whether a function may be called so; one that goes by the robot, whether any of its two may."""
    names = {one.arg: None for one in call.keywords if one.arg is not None}
    for each in (function._rover, function._legged) if isinstance(function, ByRobot) else (function,):
        try:
            inspect.signature(each).bind(*call.args, **names)
        except TypeError:
            continue
        return True
    return False


def alone(pattern: str) -> set[tuple[str, str]]:
    """What stands in backticks by itself and is like that, and in which document."""
    found = ((span, document.name) for document in DOCUMENTS for span in spans(document.read_text("utf-8")))
    return {(span, name) for span, name in found if re.fullmatch(pattern, span)}


def test_what_footfall_is_said_to_have_is_there() -> None:
    named = {
        (name.removesuffix(".py"), document.name)
        for document in DOCUMENTS
        for line in code(document.read_text("utf-8"))
        for name in re.findall(r"(?<![/\w.-])footfall(?:\.[a-zA-Z_]\w*)+", line)
    }
    assert len(named) > 30
    assert sorted(one for one in named if one[0] not in NO_MODULES and not is_there(one[0])) == []


def test_calls_of_footfall_are_as_its_functions_take_them() -> None:
    wrong, count = [], 0
    for document in DOCUMENTS:
        for line in lines_of_code(document.read_text("utf-8")):
            for call in calls(line):
                function = ast.unparse(call.func)
                if function.count(".") == 1 and function.startswith("footfall."):
                    count += 1
                    if not takes(getattr(footfall, function.removeprefix("footfall.")), call):
                        wrong.append((document.name, line))
    assert count > 15
    assert wrong == []


def test_classes_have_the_fields_that_are_named() -> None:
    wrong, count = [], 0
    for document in DOCUMENTS:
        for line in code(document.read_text("utf-8")):
            asked = [
                (one.func.id, key.arg) for one in calls(line) if isinstance(one.func, ast.Name) for key in one.keywords
            ]
            asked = [one for one in asked if one[0][0].isupper()]
            asked += re.findall(r"^([A-Z][a-z]\w*)\.([a-z]\w*)$", line)
            count += len(asked)
            wrong += [(document.name, *one) for one in asked if one[1] not in classes().get(one[0], ())]
    assert count > 15
    assert wrong == []


def test_classes_that_are_named_alone_are_there() -> None:
    named = alone(rf"[A-Z]\w*(?:{'|'.join(NAMED_FOR)})")
    assert len(named) > 3
    assert sorted(one for one in named if one[0] not in classes()) == []


def test_names_with_an_underscore_are_in_the_sources() -> None:
    sources = [
        path
        for folder in ("backend", "footfall_ui", "static/js", "benchmarks", "training", "tests")
        for path in (ROOT / folder).rglob("*.[pj][ys]")
    ]
    known = {word for path in sources for word in re.findall(r"\w+", path.read_text("utf-8"))}
    named = alone(r"[a-z]+(?:_[a-z]+)+")
    assert len(named) > 100
    assert sorted(one for one in named if one[0] not in known | OF_OTHERS) == []
