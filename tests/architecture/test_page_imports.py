"""Modules of the page import each other in no circle: each can be read, and asked by a test, with what is below it."""

import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "static" / "js"
FROM = re.compile(r"""^(?:import|export)\b[^;]*?\bfrom "([^"]+)";|^import "([^"]+)";""", re.MULTILINE)


def imported(path: Path) -> set[Path]:
    found = {(path.parent / (one or alone)).resolve() for one, alone in FROM.findall(path.read_text())}
    assert all(one.is_file() for one in found)
    return {one for one in found if one.is_relative_to(PAGE)}


def test_no_module_of_the_page_comes_back_to_itself():
    graph = {path: imported(path) for path in PAGE.rglob("*.js")}
    assert len(graph) > 80
    assert sum(map(len, graph.values())) > 300
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as err:
        pytest.fail("in a circle: " + " → ".join(one.name for one in err.args[1]))
