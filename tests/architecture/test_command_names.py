"""Commands have their names in one place: nothing else in the sources spells one, but to explain it to a reader."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from footfall.telemetry import command_kinds

ROOT = Path(__file__).resolve().parents[2]
PLACE = Path(command_kinds.__file__).resolve().relative_to(ROOT)
NAMES = re.compile(rf"\b({'|'.join(command_kinds.KINDS)})\b")


def spelt(source: str) -> Iterator[tuple[int, str]]:
    """Lines with a text, of an f-string too, that spells a name of a command; docstrings are no such texts."""
    tree = ast.parse(source)
    explained = {id(part.value) for part in ast.walk(tree) if isinstance(part, ast.Expr)}
    for part in ast.walk(tree):
        if isinstance(part, ast.Constant) and isinstance(part.value, str) and id(part) not in explained:
            yield from ((part.lineno, name) for name in NAMES.findall(part.value))


def test_no_module_spells_the_name_of_a_command() -> None:
    sources = [*(ROOT / "backend" / "footfall").rglob("*.py"), *(ROOT / "footfall_ui").rglob("*.py")]
    found = {str(p.relative_to(ROOT)): there for p in sorted(sources) if (there := list(spelt(p.read_text())))}
    place = found.pop(str(PLACE))
    assert {name for _, name in place} == set(command_kinds.KINDS)
    assert not found, f"read the name from {PLACE}"


def test_what_is_looked_for_is_found() -> None:
    explained = '"""A WAIT."""\n"""and a LEG_MOVE."""\n'
    source = explained + 'name == "WAIT"\nf"no {x} LEG_LOWER"\n"AWAIT"\n"/FootFall/POSTURE_MOVE" + x\n'
    assert sorted(spelt(source)) == [(3, "WAIT"), (4, "LEG_LOWER"), (6, "POSTURE_MOVE")]
