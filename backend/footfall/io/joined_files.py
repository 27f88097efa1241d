"""Files of the page joined to one: modules of JavaScript, each in a scope of its own, and style sheets.

Heeded is what the page's own files use: imports and exports that begin a line. What an importer gets is what a name
stands for once its module has run: nothing may be exported that changes later, and modules import each other in no
circle.
"""

import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from footfall.core.errors import InvalidInput

_STATEMENT = re.compile(
    r"^(?:"
    r"(?P<comment>/\*[\s\S]*?\*/)"
    r'|import (?:(?P<names>\{[^}]*\}|[^{}"\n]+) from )?"(?P<imported>[^"]+)";$'
    r'|export \{ (?P<listed>[^}]*) \}(?: from "(?P<exported>[^"]+)")?;$'
    r"|export (?=(?:const|function|async function|class) (?P<declared>[\w$]+))"
    r"|(?P<other>(?:import|export)\b.*)"
    r")",
    re.M,
)
_STYLE = re.compile(r'^@import "([^"]+)";$', re.M)


@dataclass(frozen=True)
class Joined:
    """text: of all in one. files: that are in it, in order."""

    text: str
    files: tuple[Path, ...]


def joined_script(entry: Path) -> Joined:
    """A module with all that it imports, however far, each once and after what it imports itself.

    Args:
        entry: its file.

    Returns:
        A script that runs in no module.

    Raises:
        InvalidInput: an import or export is written otherwise than is heeded here, or modules form a circle.
    """
    sources: dict[Path, str] = {}
    _put_in_order(entry.resolve(), sources)
    scopes = {file: _scope(entry, file) for file in sources}
    parts = (f"const {scope} = (() => {{{_body(file, sources[file], scopes)}}})();\n" for file, scope in scopes.items())
    return Joined('"use strict";' + "".join(parts), tuple(scopes))


def joined_module(entry: Path) -> Joined:
    """As :func:`joined_script`, a module that exports what each one exports: ``modules["store.js"].known``."""
    script = joined_script(entry)
    named = (f"{json.dumps(_beside(entry, file))}: {_scope(entry, file)}" for file in script.files)
    return Joined(f"{script.text}export const modules = {{ {', '.join(named)} }};\n", script.files)


def joined_style(entry: Path) -> Joined:
    """A style sheet with those that it imports in their place, and what they import.

    Args:
        entry: its file.

    Returns:
        One style sheet. Addresses in it are as they stand in each.
    """
    files: list[Path] = []

    def text(file: Path) -> str:
        files.append(file)
        return _STYLE.sub(lambda found: text((file.parent / found[1]).resolve()), file.read_text("utf-8"))

    return Joined(text(entry.resolve()), tuple(files))


def _put_in_order(file: Path, sources: dict[Path, str], above: tuple[Path, ...] = ()) -> None:
    """Puts what a module's file holds after that of all that it imports. above: which import it, one the other."""
    if file in above:
        circle = " → ".join(one.name for one in (*above[above.index(file) :], file))
        raise InvalidInput(f"modules import each other in a circle: {circle}")
    if file not in sources:
        source = file.read_text("utf-8")
        for address in _imports(source):
            _put_in_order((file.parent / address).resolve(), sources, (*above, file))
        sources[file] = source


def _imports(source: str) -> Iterator[str]:
    """Addresses of a module's imports, and of what it exports on."""
    for found in _STATEMENT.finditer(source):
        if address := found["imported"] or found["exported"]:
            yield address


def _body(file: Path, source: str, scopes: dict[Path, str]) -> str:
    """A module as the body of a function that returns what it exports, in as many lines."""
    exports: list[str] = []

    def scope(address: str) -> str:
        return scopes[(file.parent / address).resolve()]

    def inside(found: re.Match[str]) -> str:
        if found["comment"]:
            return found[0]
        if found["imported"]:
            names = found["names"]
            return f"const {_names(names)} = {scope(found['imported'])};" if names else ""
        if found["other"]:
            raise InvalidInput(
                f'{file.name}: can\'t join {found[0]!r}; import {{ a, b as c }}, "* as a" or a name from "a file", and '
                "export a const, a function, a class or { a, b as c }"
            )
        if found["declared"]:
            exports.append(found["declared"])
            return ""
        of = f"{scope(found['exported'])}." if found["exported"] else ""
        exports.extend(f"{outside}: {of}{own}" for own, outside in map(_renamed, found["listed"].split(", ")))
        return ""

    return f"{_STATEMENT.sub(inside, source)}\nreturn {{ {', '.join(exports)} }};\n"


def _names(imported: str) -> str:
    """What stands left of an import as what stands left of an assignment."""
    if imported.startswith("* as "):
        return imported.removeprefix("* as ")
    if not imported.startswith("{"):
        return f"{{ default: {imported} }}"
    return imported.replace(" as ", ": ")


def _renamed(name: str) -> tuple[str, str]:
    """``a as b`` → (a, b); ``a`` → (a, a)."""
    inside, _, outside = name.partition(" as ")
    return inside, outside or inside


def _scope(entry: Path, file: Path) -> str:
    return re.sub(r"\W", "$", _beside(entry, file))


def _beside(entry: Path, file: Path) -> str:
    return Path(os.path.relpath(file, entry.resolve().parent)).as_posix()
