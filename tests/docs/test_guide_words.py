"""The operator's guide calls what is on the page as the page does."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ROOT / "docs/operators-guide.md"
CATALOGUE = ROOT / "static/js/texts"
SAID = re.compile(r'"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`')
"""A text in a source: plain, or with values in it."""
EMPHASIS = re.compile(r"(?<![*\w\\])(\*{1,2})(?=\S)([^*\n]+?)(?<=\S)\1(?![*\w])")
SERVERS = {
    "Where the leg may stand": "backend/footfall/maps/layers.py",
    "Where the leg may stand, with friction": "backend/footfall/maps/layers.py",
    "Wheels on one side of the ground": "backend/footfall/planning/execution/prediction_checks.py",
}
"""Names that the page has from the server, and where these stand."""


def emphasised(text: str) -> set[str]:
    """Names in a document: what is emphasised and begins with a capital, and is no heading (these end with a stop)."""
    prose = re.sub(r"`[^`\n]*`", "`", text)
    names = {name for _, name in EMPHASIS.findall(prose)}
    return {name for name in names if name[0].isupper() and not name.endswith(".")}


def catalogue() -> Iterator[str]:
    """Every text of the page as a pattern: ``…`` for what is put in, be it a value or a field."""
    for path in sorted(CATALOGUE.glob("*.js")):
        for plain, made in SAID.findall(path.read_text()):
            yield re.sub(r"\$\{(?:[^{}]|\{[^{}]*\})*\}|\{\}", "…", plain or made)


def said(name: str, texts: list[str]) -> bool:
    """Whether a text is that name, or begins with it and goes on with a value, a unit or a stop.

    A name that begins a sentence of the guide may have a small letter on the page.
    """
    begins = re.compile(rf"(?i:{re.escape(name[0])}){re.escape(name[1:])}(?:$| ?[…:.,?()\[])")
    return any(begins.match(text) or filled(text).fullmatch(name) for text in (one.lstrip("…●⇄▲✕ ") for one in texts))


@cache
def filled(text: str) -> re.Pattern[str]:
    """What a text that begins with a word may come to when its values are in."""
    return re.compile(r"\S.*".join(map(re.escape, text.split("…"))) if text[:1].isalpha() else "(?!)")


def test_the_guide_has_the_names_of_the_page():
    texts = list(catalogue())
    names = emphasised(GUIDE.read_text())
    assert len(names) > 80
    wrong = sorted(name for name in names - SERVERS.keys() if not said(name, texts))
    assert wrong == [], "the page has no such words"


def test_what_the_server_names_is_there():
    names = emphasised(GUIDE.read_text())
    for name, where in SERVERS.items():
        assert name in names
        assert f'"{name}"'.lower() in (ROOT / where).read_text().lower()


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("Press *Plan step* (`P`), **Clear stop**, or *race*.", {"Plan step", "Clear stop"}),
        ("**Arm and send.** *Arm*, then 2 * 3 * 4, `*No*`.", {"Arm"}),
        ("A\\* and *Walk to…* (`=`)", {"Walk to…"}),
    ],
)
def test_names_are_found(text: str, names: set[str]):
    assert emphasised(text) == names


@pytest.mark.parametrize(
    ("name", "holds"),
    [
        ("Plan step", True),
        ("Look after", True),
        ("Show where leg N can stand", True),
        ("No plan", True),
        ("Plan steps", False),
        ("Pla", False),
        ("Show where leg N may stand", False),
        ("What Eve shows", True),
        ("Or more", True),
        ("Eve", False),
    ],
)
def test_a_name_is_that_of_a_text(name: str, holds: bool):
    texts = [
        "Plan step",
        "Look after …",
        "Show where leg … can stand",
        "No plan: …",
        "⇄ What … shows",
        "… or more",
        "…",
    ]
    assert said(name, texts) == holds
