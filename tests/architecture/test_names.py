"""A name says one thing: no two public classes of the backend share one, and few modules do."""

import ast
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BACKEND = ROOT / "backend" / "footfall"

SHARED_CLASSES: Mapping[str, str] = {
    "Calibration": "what a request gives, and what the stiffness is: both names stand in the OpenAPI document",
    "CameraModel": "the API's spelling of the telemetry's value; its name stands in the OpenAPI document",
    "Feet": "a value of sequences that is stored by this name, a kernel's table, and the feet of robots of others",
    "Footfall": "a value that is stored by this name, and the same of robots that others described",
    "Ground": "what legged planners stand on, and a kernel's table",
    "Guide": "the way of the chassis of ATHLETE's walks, and of robots that others described",
}
"""Name → why two classes may have it."""
MIRRORED = ("api/routes", "api/bodies", "session/answers", "scene")
"""Packages whose modules are named as what they tell or draw of other packages."""
SHARED_MODULES: Mapping[str, str] = {
    "problem": "what is asked of a planner, in the package of each",
    "plan": "how a planner answers, in the package of each",
}
"""Name → why modules of more than two packages may have it."""


def sources() -> Iterator[Path]:
    yield from sorted(BACKEND.rglob("*.py"))
    yield from sorted((ROOT / "footfall_ui").rglob("*.py"))


def public_classes() -> dict[str, list[str]]:
    """Name → modules of the backend that have a class of that name at their top."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in sorted(BACKEND.rglob("*.py")):
        for part in ast.parse(path.read_text()).body:
            if isinstance(part, ast.ClassDef) and not part.name.startswith("_"):
                found[part.name].append(str(path.relative_to(BACKEND)))
    return found


def packages() -> dict[str, list[str]]:
    """Name of a module → packages that have one of that name, but for MIRRORED."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in sources():
        package = path.parent.relative_to(BACKEND if BACKEND in path.parents else ROOT / "footfall_ui").as_posix()
        if path.stem != "__init__" and package not in MIRRORED:
            found[path.stem].append(package)
    return found


def test_no_two_public_classes_share_a_name() -> None:
    shared = {name: places for name, places in public_classes().items() if len(places) > 1}
    strange = {name: places for name, places in shared.items() if name not in SHARED_CLASSES}
    assert not strange, "name each by what it is"
    assert not set(SHARED_CLASSES) - set(shared), "these are no longer shared: take them out of SHARED_CLASSES"


def test_few_modules_share_a_name() -> None:
    shared = {name: places for name, places in packages().items() if len(places) > 2}
    strange = {name: places for name, places in shared.items() if name not in SHARED_MODULES}
    assert not strange, "name each by what is in it"
    assert not set(SHARED_MODULES) - set(shared), "these are no longer shared: take them out of SHARED_MODULES"


def test_packages_that_mirror_others_are_there() -> None:
    here = {path.parent.as_posix() for path in sources()}
    missing = [one for one in MIRRORED if not any(each.endswith(f"/{one}") for each in here)]
    assert not missing
