"""Rules of the structure that import-linter does not see."""

import ast
import subprocess
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BACKEND = ROOT / "backend" / "footfall"
PURE = ("core", "telemetry", "robot", "balance", "terrain", "maps", "planning", "sequence")
OWNERS = {
    "cv2": "backend/footfall/terrain",
    "mujoco": "backend/footfall/sim/physics",
    "ompl": "backend/footfall/planning",
    "viser": "footfall_ui",
}
MAX_LINES = 400
VAGUE = {"data", "manager", "handler", "util", "utils", "helper", "helpers", "node", "common", "misc"}


def sources() -> Iterator[Path]:
    yield from sorted(BACKEND.rglob("*.py"))
    yield from sorted((ROOT / "footfall_ui").rglob("*.py"))
    yield from sorted((ROOT / "training").rglob("*.py"))


@cache
def imported(path: Path) -> set[str]:
    """Top-level names of everything the file imports, at any depth."""
    names: set[str] = set()
    for part in ast.walk(ast.parse(path.read_text())):
        if isinstance(part, ast.Import):
            names |= {alias.name.split(".")[0] for alias in part.names}
        elif isinstance(part, ast.ImportFrom) and part.module and part.level == 0:
            names.add(part.module.split(".")[0])
    return names


def test_there_are_sources() -> None:
    assert len(list(sources())) > 40


@pytest.mark.parametrize("library", OWNERS)
def test_each_library_has_one_owner(library: str) -> None:
    owner = ROOT / OWNERS[library]
    users = [p for p in sources() if library in imported(p)]
    assert users, f"nobody uses {library}"
    strangers = [str(p.relative_to(ROOT)) for p in users if owner not in p.parents]
    assert not strangers, f"{library} belongs to {OWNERS[library]}"


def test_modules_stay_small() -> None:
    long = {str(p.relative_to(ROOT)): n for p in sources() if (n := len(p.read_text().splitlines())) > MAX_LINES}
    assert not long


def modules() -> dict[str, Path]:
    """Every module by the name that it is imported under."""
    roots = {path: ROOT if BACKEND not in path.parents else BACKEND.parent for path in sources()}
    named = {path: ".".join(path.relative_to(root).with_suffix("").parts) for path, root in roots.items()}
    return {name.removesuffix(".__init__"): path for path, name in named.items()}


def uses(path: Path, known: Iterable[str]) -> set[str]:
    """Modules of ours that the file imports, at any depth, those for types alone too."""
    found: set[str] = set()
    for part in ast.walk(ast.parse(path.read_text())):
        if isinstance(part, ast.Import):
            found |= {alias.name for alias in part.names}
        elif isinstance(part, ast.ImportFrom) and part.module and part.level == 0:
            deeper = {f"{part.module}.{alias.name}" for alias in part.names}
            found |= {name if name in known else part.module for name in deeper}
    return found & set(known)


def test_no_module_comes_back_to_itself_not_even_for_a_type() -> None:
    known = modules()
    order = TopologicalSorter({name: uses(path, known) - {name} for name, path in known.items()})
    order.prepare()  # raises CycleError, which names the circle


def test_modules_are_named_for_what_they_are() -> None:
    vague = [str(p.relative_to(ROOT)) for p in sources() if VAGUE & set(p.stem.split("_"))]
    assert not vague


def test_pure_layers_open_no_files() -> None:
    calls = {"open", "read_text", "read_bytes", "write_text", "write_bytes", "savez", "savez_compressed", "imread"}
    offenders = []
    for layer in PURE:
        for path in sorted((BACKEND / layer).rglob("*.py")):
            if "assets" in path.parts:  # the generator of the robot's files is a script
                continue
            for part in ast.walk(ast.parse(path.read_text())):
                if isinstance(part, ast.Call):
                    name = part.func.id if isinstance(part.func, ast.Name) else getattr(part.func, "attr", "")
                    if name in calls:
                        offenders.append(f"{path.relative_to(ROOT)}:{part.lineno} {name}")
    assert not offenders


def test_nobody_needs_what_learns() -> None:
    """A policy is a file: who walks by it does not learn."""
    assert not [path for path in sources() if ROOT / "training" not in path.parents and "training" in imported(path)]


def test_no_assert_as_validation() -> None:
    offenders = [
        f"{path.relative_to(ROOT)}:{part.lineno}"
        for path in sources()
        for part in ast.walk(ast.parse(path.read_text()))
        if isinstance(part, ast.Assert)
    ]
    assert not offenders


def tracked() -> list[str]:
    """Names of the files that git keeps."""
    listing = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listing.returncode:
        pytest.skip("not a git checkout, so there is no list of tracked files")
    return listing.stdout.splitlines()


def test_git_keeps_nothing_beside_the_projects_own_folders() -> None:
    """A session that a program left in the checkout once came in with a commit."""
    kept = {
        *(".ci", ".dockerignore", ".gitignore", "CHANGELOG.md", "CONTRIBUTING.md", "Dockerfile", "LICENSE", "Makefile"),
        *("README.md", "backend", "benchmarks", "docs", "examples", "footfall_ui", "locks", "pyproject.toml"),
        *("sample_sessions", "static", "tests", "training", "typings"),
    }
    assert {name.partition("/")[0] for name in tracked()} <= kept


def test_no_machine_path_or_index_address_in_tracked_files() -> None:
    # spelt in two parts so that this file does not name them itself
    words = [
        "/work" + "/",
        "/root" + "/",
        "py" + "pi.org",
        "python" + "hosted",
        "registry.npm" + "js",
        "--index" + "-url",
    ]
    offenders = []
    for name in tracked():
        path = ROOT / name
        if path.suffix in {".png", ".npz", ".zip", ".obj", ".stl"} or not path.is_file():
            continue
        text = path.read_text(errors="ignore")
        offenders += [f"{name}: {word}" for word in words if word in text]
    assert not offenders
