"""Files and folders that the developers' documents name are there."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = ("CONTRIBUTING.md", "docs/architecture.md", "docs/testing.md", "docs/figures.md")
PLACES = (ROOT, ROOT / "backend", ROOT / "backend/footfall", ROOT / "backend/footfall/session", ROOT / "static/js")
"""What a path in a document is told from."""
NAMED = re.compile(r"`([\w./-]+\.(?:py|js|css|mjs|toml|csv)|[\w.-]+(?:/[\w.-]+)*/)`")


BARE = {
    path.name
    for folder in ("backend", "footfall_ui", "static", "tests", "benchmarks")
    for path in (ROOT / folder).rglob("*.*")
}
"""Files that a document may name alone, where the text says whose they are."""


def named(text: str) -> Iterator[tuple[str, str]]:
    """Each file and folder that a text names, with the line where."""
    for line in text.splitlines():
        for name in NAMED.findall(line):
            yield name, line


def is_there(name: str, line: str) -> bool:
    """Whether it is told from one of PLACES, or lies beside, or in, what its line names before; or is in BARE."""
    around = list(PLACES)
    for one in NAMED.findall(line[: line.index(f"`{name}`")]):
        around += [path if path.is_dir() else path.parent for place in PLACES if (path := place / one).exists()]
    return name in BARE or any((place / name).exists() for place in around)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_what_a_document_names_is_there(document: str) -> None:
    found = list(named((ROOT / document).read_text("utf-8")))
    assert found, "a document that names no file needs no place in DOCUMENTS"
    assert [name for name, line in found if not is_there(name, line)] == []


@pytest.mark.parametrize(
    ("line", "there"),
    [
        ("`robot/ik.py`", True),
        ("`robot/no_such.py`", False),
        ("`planning/legged/circulate.py`; `legged/no_such.py`", False),
        ("`robot/limb/`: `numeric.py`, and `no_such.py`", False),
        ("`numeric.py` of `robot/limb/`", True),
        ("`products/no_such/`", False),
    ],
)
def test_a_name_is_told_from_where_the_document_says(line: str, there: bool) -> None:
    assert all(is_there(name, line) for name, _ in named(line)) == there
