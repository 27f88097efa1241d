"""What rounds to nothing is written without a sign: no text of the backend says "-0.000" (format option "z")."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(path for part in ("backend", "footfall_ui") for path in (ROOT / part).rglob("*.py"))
TEMPLATE = re.compile(r"\{[^{}]*:([^{}]*\.\d+f)\}")


def formats(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and text of every format of a number with digits behind the point, in f-strings and templates."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FormattedValue) and isinstance(node.format_spec, ast.JoinedStr):
            parts = (one.value if isinstance(one, ast.Constant) else "n" for one in node.format_spec.values)
            if (spec := "".join(map(str, parts))).endswith("f"):
                yield node.lineno, spec
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            for spec in TEMPLATE.findall(node.value):
                yield node.lineno, spec


def test_every_format_of_a_number_drops_the_sign_of_nothing():
    found = {path: list(formats(ast.parse(path.read_text()))) for path in SOURCES}
    assert sum(map(len, found.values())) > 100
    bare = [
        f"{path.relative_to(ROOT)}:{line} {spec}"
        for path, ones in found.items()
        for line, spec in ones
        if "z" not in spec
    ]
    assert not bare, "write {x:z.3f}, not {x:.3f}:\n" + "\n".join(bare)


@given(st.floats(-1e-2, 1e-2), st.integers(0, 4))
def test_the_option_drops_no_other_sign(value, digits):
    told, bare = f"{value:z.{digits}f}", f"{value:.{digits}f}"
    assert told == (bare.lstrip("-") if float(bare) == 0 else bare)
