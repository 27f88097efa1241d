"""What scripts call says all of itself: each argument, what comes back, what is raised."""

import ast
import builtins
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TypeGuard

import pytest

import footfall
from footfall.core import errors

BACKEND = Path(__file__).resolve().parents[2] / "backend" / "footfall"
COMPLETE = ("core", "telemetry", "robot", "balance", "terrain", "maps", "planning", "sequence")
"""Packages whose public functions of numbers, with three parameters or more, have sections too."""
NUMBERS = ("Array", "Floats32", "Ints", "Mask", "float")
"""What is in the types of arguments that have shapes or units."""
SECTIONS = ("Args", "Returns", "Yields", "Raises", "Attributes", "References")
ENTRY = re.compile(r"    ([\w*]+): \S")


def sections(doc: str) -> dict[str, list[str]]:
    """Name of each section → its lines, still indented."""
    found: dict[str, list[str]] = {}
    within = None
    for line in doc.splitlines():
        if line.rstrip(":") in SECTIONS and line.endswith(":"):
            within = found.setdefault(line[:-1], [])
        elif line and not line.startswith(" "):
            within = None
        elif within is not None and line:
            within.append(line)
    return found


def entries(lines: list[str]) -> list[str]:
    """What the entries of a section are of, in order."""
    return [match[1] for line in lines if (match := ENTRY.match(line))]


def parameters(function: ast.FunctionDef) -> list[ast.arg]:
    given = function.args
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    return [one for one in every if one.arg not in ("self", "cls")]


def raised(function: ast.FunctionDef) -> set[str]:
    """Classes that the function itself raises by name; functions in it may catch what they raise."""
    found, open_yet = set[str](), list[ast.AST](function.body)
    while open_yet:
        part = open_yet.pop()
        if isinstance(part, (ast.FunctionDef, ast.Lambda)):
            continue
        if isinstance(part, ast.Raise) and part.exc is not None:
            what = part.exc.func if isinstance(part.exc, ast.Call) else part.exc
            name = what.attr if isinstance(what, ast.Attribute) else getattr(what, "id", "")
            if name.lstrip("_")[:1].isupper():
                found.add(name)
        open_yet += ast.iter_child_nodes(part)
    return found


def lacking(function: ast.FunctionDef) -> list[str]:
    """What a docstring lacks of Google's sections, or says wrongly."""
    said = sections(ast.get_docstring(function) or "")
    named, told = [one.arg for one in parameters(function)], entries(said.get("Args", []))
    lacks = [] if told == named else [f"Args says {told}, the parameters are {named}"]
    answers = function.returns is not None and not (
        isinstance(function.returns, ast.Constant) and function.returns.value is None
    )
    if answers and not (said.get("Returns") or said.get("Yields")):
        lacks.append("Returns is missing")
    listed = entries(said.get("Raises", []))
    lacks += [f"Raises leaves out {one}" for one in sorted(raised(function) - set(listed))]
    lacks += [f"Raises names {one}, which is no error" for one in listed if not is_error(one)]
    return lacks


def is_error(name: str) -> bool:
    known = getattr(errors, name, getattr(builtins, name, None))
    return isinstance(known, type) and issubclass(known, Exception)


def found_in(module: str, name: str) -> list[ast.FunctionDef | ast.ClassDef]:
    """What a module means by a name: what it defines, what it takes from elsewhere, or one for each kind of robot."""
    path = BACKEND.parent / f"{module.replace('.', '/')}.py"
    tree = ast.parse((path if path.is_file() else path.with_suffix("") / "__init__.py").read_text())
    for part in reversed(tree.body):  # what overloads belong to comes after them
        if isinstance(part, (ast.FunctionDef, ast.ClassDef)) and part.name == name:
            return [part]
        if isinstance(part, ast.ImportFrom) and part.module:
            for alias in part.names:
                if (alias.asname or alias.name) == name:
                    return found_in(part.module, alias.name)
        if isinstance(part, ast.Assign) and ast.unparse(part.targets[0]) == name:
            assert isinstance(part.value, ast.Call)
            assert ast.unparse(part.value.func) == "ByRobot"
            return [one for each in part.value.args for one in found_in(module, ast.unparse(each))]
    raise AssertionError(f"{module} has no {name}")


def outward() -> tuple[dict[str, ast.FunctionDef], dict[str, ast.ClassDef]]:
    """Functions that scripts call, those of each kind of robot, and methods of classes that they make; the classes."""
    functions: dict[str, ast.FunctionDef] = {}
    classes: dict[str, ast.ClassDef] = {}
    for name, module in footfall._where.items():
        every = found_in(module, name)
        for one, robots in zip(every, ("rovers", "others"), strict=False):
            if isinstance(one, ast.ClassDef):
                classes[name] = one
                functions |= {f"{name}.{part.name}": part for part in one.body if is_called(part)}
            else:
                functions[f"{name} of {robots}" if len(every) > 1 else name] = one
    return functions, classes


def is_called(part: ast.stmt) -> TypeGuard[ast.FunctionDef]:
    """Whether it is a public method; ``check`` is called by the value itself, and a property has no arguments."""
    if not isinstance(part, ast.FunctionDef) or part.name.startswith("_") or part.name == "check":
        return False
    return "property" not in [ast.unparse(one) for one in part.decorator_list]


OUTWARD, MADE = outward()


def test_all_that_scripts_call_is_looked_at() -> None:
    assert {"plan_step of rovers", "plan_step of others", "load_robot", "replay", "BodyShift.between"} <= set(OUTWARD)
    names = {name.split(" ")[0].split(".")[0] for name in OUTWARD}
    assert names == set(footfall.__all__) - {"__version__"}


@pytest.mark.parametrize("name", OUTWARD)
def test_what_scripts_call_says_all_of_itself(name: str) -> None:
    assert not lacking(OUTWARD[name])


@pytest.mark.parametrize("name", [name for name in OUTWARD if "." not in name])
def test_functions_for_scripts_say_what_they_raise(name: str) -> None:
    assert sections(ast.get_docstring(OUTWARD[name]) or "").get("Raises")


@pytest.mark.parametrize("name", MADE)
def test_values_that_scripts_make_say_what_each_field_is(name: str) -> None:
    fields = [ast.unparse(part.target) for part in MADE[name].body if isinstance(part, ast.AnnAssign)]
    assert fields
    assert entries(sections(ast.get_docstring(MADE[name]) or "").get("Attributes", [])) == fields


def of_numbers(package: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Public functions with shapes or units in three parameters or more; compiled ones keep the short form."""
    for path in sorted((BACKEND / package).rglob("*.py")):
        for part in ast.parse(path.read_text()).body:
            if not isinstance(part, ast.FunctionDef) or part.name.startswith("_") or path.stem.endswith("_kernel"):
                continue
            types = [ast.unparse(one.annotation) for one in parameters(part) if one.annotation is not None]
            if len(parameters(part)) >= 3 and any(word in one for one in types for word in NUMBERS):
                yield f"{path.relative_to(BACKEND)} {part.name}", part


@pytest.mark.parametrize("package", COMPLETE)
def test_functions_of_complete_packages_have_sections(package: str) -> None:
    every = dict(of_numbers(package))
    assert every, "there is no such function: take the package out of COMPLETE"
    assert not {name: lacks for name, part in every.items() if (lacks := lacking(part))}


GOOD = '''
def reached(robot, heights, *, step=0.1) -> float:
    """How far a foot gets.

    Args:
        robot: the rover.
        heights: (n,) of the ground [m]: a colon,
            and a second line.
        step: between samples [m].

    Returns:
        The distance [m].

    Raises:
        InvalidInput: the step is not above zero.
    """
    def inner():
        raise NotFound("caught below")

    if step <= 0:
        raise InvalidInput("no step")
    raise _made_elsewhere()
'''


@pytest.mark.parametrize(
    ("was", "becomes", "lack"),
    [
        ("", "", ""),
        ("        robot: the rover.\n", "", "Args says ['heights', 'step']"),
        ("robot, heights", "heights, robot", "Args says"),
        ("step: between", "stride: between", "Args says"),
        ("    Args:\n", "    Arguments:\n", "Args says []"),
        ("    Returns:\n        The distance [m].\n", "", "Returns is missing"),
        ("InvalidInput: the", "NotFound: the", "Raises leaves out InvalidInput"),
        ("    Raises:\n        InvalidInput: the step is not above zero.\n", "", "Raises leaves out InvalidInput"),
        ("        InvalidInput: the", "        Sorry: the", "Raises names Sorry"),
        ("raise InvalidInput(", "raise errors.Busy(", "Raises leaves out Busy"),
        ('raise InvalidInput("no step")', "raise Busy", "Raises leaves out Busy"),
    ],
)
def test_each_lack_is_seen(was: str, becomes: str, lack: str) -> None:
    assert was in GOOD
    (function,) = ast.parse(GOOD.replace(was, becomes, 1) if was else GOOD).body
    assert isinstance(function, ast.FunctionDef)
    found = lacking(function)
    assert bool(found) == bool(lack)
    assert lack in " ".join(found)
