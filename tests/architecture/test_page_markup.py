"""The page's markup holds no words: it names texts of the catalogue, and ``static/js/fill.js`` puts them in."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from html.parser import HTMLParser

import pytest

from footfall_ui.page_files import JOINED
from tests.architecture.test_page_acts import STATIC
from tests.support.node import run

PAGES = ("index.html", "login.html")
NAMES = ("data-text", "data-title", "data-label", "data-placeholder")
"""Attributes whose value is a key of the catalogue."""
READ = (
    "title",
    "aria-label",
    "placeholder",
    "alt",
    "label",
    "aria-description",
    "aria-roledescription",
    "aria-valuetext",
)
"""Attributes that are read, or read aloud."""
PROPER = {"FootFall"}
"""Names that are the same in every language."""
VOID = ("area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr")
WORD = re.compile(r"[^\W\d_]|[%°]")
"""A letter, or the sign of a unit: arrows, dashes and digits are no words."""


@dataclass
class Element:
    tag: str
    given: dict[str, str]
    line: int
    texts: list[str] = field(default_factory=list)
    children: int = 0


class Markup(HTMLParser):
    """The elements of a page; what stands in ``noscript`` is left out: it is read where no script can put words in."""

    def __init__(self, source: str):
        super().__init__()
        self.elements: list[Element] = []
        self._open = [Element("", {}, 0)]
        self.feed(source)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        made = Element(tag, {name: value or "" for name, value in attrs}, self.getpos()[0])
        self._open[-1].children += 1
        self.elements.append(made)
        if tag not in VOID:
            self._open.append(made)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self._open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop().tag == tag, f"line {self.getpos()[0]}: </{tag}> closes nothing"

    def handle_data(self, data: str) -> None:
        if all(one.tag != "noscript" for one in self._open):
            self._open[-1].texts.append(data)


def elements(page: str) -> list[Element]:
    return Markup((STATIC / page).read_text()).elements


def strays(source: str) -> list[str]:
    """Words that stand in markup itself."""
    return [
        f"{one.line}: {text.strip()}"
        for one in Markup(source).elements
        for text in [*one.texts, *(one.given.get(name, "") for name in READ)]
        if WORD.search(text) and text.strip() not in PROPER
    ]


@cache
def catalogue() -> dict[str, str | None]:
    """Every text of the page by its key; null is one that values are in."""
    areas = json.loads(run("catalogue.mjs", str(STATIC / "js/texts")))
    return {f"{area}.{name}": text for area, texts in areas.items() for name, text in texts.items()}


def named(page: str) -> Iterator[tuple[Element, str, str]]:
    """Element, attribute and key of everything that a page's markup names."""
    return ((one, name, one.given[name]) for one in elements(page) for name in NAMES if name in one.given)


def keys() -> set[str]:
    return {key for page in PAGES for _, _, key in named(page)}


@pytest.mark.parametrize("page", PAGES)
def test_words_stand_in_the_catalogue(page: str):
    assert strays((STATIC / page).read_text()) == [], (
        "these belong into static/js/texts, and a data-text in their place"
    )


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("<p>Send</p>", ["1: Send"]),
        ('<p data-text="a.b">Send</p>', ["1: Send"]),
        ("<label><input> m</label>", ["1: m"]),
        ("<output>100 %</output>", ["1: 100 %"]),
        ('<p>\n<button title="Sends">▶</button></p>', ["2: Sends"]),
        ('<ul aria-label="Legs"></ul>', ["1: Legs"]),
        ('<input placeholder="as is">', ["1: as is"]),
        ('<p data-text="a.b"><span>1</span></p><button>−</button>', []),
        ("<h1>FootFall</h1><noscript>Allow scripts.</noscript>", []),
    ],
)
def test_words_of_markup_are_found(source: str, found: list[str]):
    assert strays(source) == found


@pytest.mark.parametrize("page", PAGES)
def test_what_the_markup_names_is_a_text_and_has_as_many_places_as_the_element_has_children(page: str):
    wrong = []
    for one, name, key in named(page):
        text = catalogue().get(key)
        if text is None:
            wrong.append(f"{one.line}: {name}={key} is no text of the catalogue")
        elif text.count("{}") != (one.children if name == "data-text" else 0):
            wrong.append(f"{one.line}: {key} {text!r} in an element with {one.children} children")
    assert wrong == []


def test_a_text_with_places_is_in_the_markup():
    assert {key for key, text in catalogue().items() if text is not None and "{}" in text} - keys() == set()


def test_the_filling_module_has_every_area_that_the_markup_names():
    areas = re.search(r"const AREAS = \{ ([^}]*) \};", (STATIC / "js/fill.js").read_text())
    assert areas
    assert {key.split(".")[0] for key in keys()} <= set(areas[1].split(", "))


@pytest.mark.parametrize("page", PAGES)
def test_the_words_come_first_and_their_lack_is_told(page: str):
    source = (STATIC / page).read_text()
    (script,) = re.findall(r'<script type="module" src="/?js/(\w+\.js)"></script>', source)
    assert source.count("<script") == 1
    assert script in JOINED
    imported = re.findall(r'^import "([^"]+)";', (STATIC / "js" / script).read_text(), re.MULTILINE)
    assert imported[0] == "./fill.js"
    assert re.search(r"<noscript><p>[^<]*\bJavaScript\b[^<]*\bSTOP THE ROVER\b[^<]*</p></noscript>", source)


def test_texts_have_true_signs_and_titles_say_something():
    texts = {key: text for key, text in catalogue().items() if text is not None}
    assert len(texts) > 500
    hyphens = [text for text in texts.values() if re.search(r"(?:^|[\s(\[,:±])-[\dxyz]", text)]
    assert hyphens == [], "a hyphen is no minus sign"
    assert [text for text in texts.values() if "..." in text] == []
    titles = [key for page in PAGES for _, name, key in named(page) if name == "data-title"]
    assert [key for key in titles if len(texts[key]) < 3] == [], "a key is said by the act that has it"


def test_what_a_described_robot_lacks_is_said_for_every_part():
    named = {one.given["data-alone"] for one in elements("index.html") if "data-alone" in one.given}
    table = re.search(r"const ALONE = \{(.*?)\n\};", (STATIC / "js/texts/robot.js").read_text(), re.DOTALL)
    assert table
    assert named == set(re.findall(r"^  (\w+): ", table[1], re.MULTILINE))
