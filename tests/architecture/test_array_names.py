"""Kinds of arrays have their names in one module; no other gives them names of its own."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NAMES = ROOT / "backend/footfall/core/arrays.py"
FOLDERS = ("backend", "footfall_ui", "training", "benchmarks")


def named(source: str) -> list[str]:
    """What a module names at its top that is an array of one kind and nothing else."""
    found: list[str] = []
    for part in ast.parse(source).body:
        if isinstance(part, ast.Assign | ast.AnnAssign) and part.value is not None:
            target = part.targets[0] if isinstance(part, ast.Assign) else part.target
            kind = part.value.value if isinstance(part.value, ast.Subscript) else None
            if ast.unparse(kind or part.value).split(".")[-1] in ("NDArray", "ndarray"):
                found.append(ast.unparse(target))
    return found


def test_only_one_module_names_kinds_of_arrays() -> None:
    assert len(named(NAMES.read_text())) > 5
    paths = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py")) if path != NAMES]
    assert len(paths) > 500
    assert {str(path.relative_to(ROOT)): names for path in paths if (names := named(path.read_text()))} == {}


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("Rows = NDArray[np.int64]", ["Rows"]),
        ("Rows: TypeAlias = npt.NDArray[np.int64]", ["Rows"]),
        ("Rows = np.ndarray", ["Rows"]),
        ("Pair = tuple[NDArray[np.int64], int]", []),
        ("rows = np.array([1, 2])", []),
        ("Rows: TypeAlias", []),
    ],
)
def test_a_name_for_a_kind_is_found(source: str, found: list[str]) -> None:
    assert named(source) == found
