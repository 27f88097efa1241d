"""All that is read from the scripts of the page, and of the page that plays alone, stands in one catalogue.

That is ``static/js/texts``; the page's markup is looked at in ``test_page_markup.py``.

What counts as a text is said in ``tests/tools/texts.mjs``, which finds them.
"""

import json
import re
from collections import Counter
from pathlib import Path

from tests.architecture.test_page_acts import STATIC
from tests.architecture.test_page_markup import keys
from tests.support.node import run

JS = STATIC / "js"
CATALOGUE = JS / "texts"
ELSEWHERE = {
    "figures.js": "digits, signs and units, each in one way: the catalogue takes them from there",
    "imagelines.js": "shapes of SVG and names of classes",
}
"""Modules that are not looked at, and why."""
NO_TEXTS = {
    ("scene.js", "[data-floating-window]"): "a style sheet for the scene's frame",
    ("panels/account.js", "[data-needs] :is("): "a selector",
}
"""How strings begin that look like texts and are none, and what they are."""
SIGNED = {
    ("link.js", "signed(degrees, 1)}°"),
    ("link.js", "signed(difference)} m"),
    ("walk.js", "signed(length, 2)} m"),
    ("scene.js", "signed(height)} m"),
}
"""Differences with a unit: these have a sign either way."""


def found(sources: dict[str, str]) -> list[tuple[str, int, str]]:
    """Module, line and text of every text in sources of the page."""
    return [(one["name"], one["line"], one["text"]) for one in json.loads(run("texts.mjs", given=json.dumps(sources)))]


def scripts() -> list[Path]:
    return [*sorted(JS.rglob("*.js")), STATIC / "player" / "player.js"]


def sources() -> dict[str, str]:
    paths = [path for path in scripts() if CATALOGUE not in path.parents]
    names = {path: path.relative_to(JS if JS in path.parents else STATIC).as_posix() for path in paths}
    return {name: path.read_text() for path, name in names.items() if name not in ELSEWHERE}


def is_none(name: str, text: str) -> bool:
    return any(name == module and text.startswith(begin) for module, begin in NO_TEXTS)


def test_texts_stand_in_the_catalogue():
    texts = [one for one in found(sources()) if not is_none(one[0], one[2])]
    strays = [f"{name}:{line} {text!r}" for name, line, text in texts]
    assert not strays, "these belong into static/js/texts:\n" + "\n".join(strays)


def test_every_exception_is_there():
    texts = found(sources())
    for module, begin in NO_TEXTS:
        assert any(name == module and text.startswith(begin) for name, _, text in texts), begin
    assert {name for name in ELSEWHERE if not (JS / name).is_file()} == set()


FIGURE = re.compile(r"\b(?:fixed|signed)\([^`{}]*\)\} ?(m|mm|N|s|%|°|rad)(?![\w·/])")
"""A figure, and behind it a unit that ``figures.js`` writes with it."""


def test_figures_of_the_catalogue_have_their_units_from_one_place():
    assert FIGURE.findall("`${fixed(x, 2)} m, ${fixed(100 * y)} %, ${signed(z)}° off`") == ["m", "%", "°"]
    bare = {(path.name, found[0]) for path in CATALOGUE.glob("*.js") for found in FIGURE.finditer(path.read_text())}
    assert bare <= SIGNED, "figures.js has metres, newtons, seconds, degrees, radians, percent"


def test_every_text_of_the_catalogue_is_said():
    exported = {
        (path.stem, name)
        for path in CATALOGUE.glob("*.js")
        for name in re.findall(r"^export (?:const|function) (\w+)", path.read_text(), re.M)
    }
    said = {tuple(key.split(".")) for key in keys()}
    for path in scripts():
        source = path.read_text()
        folder = "" if path.parent == CATALOGUE else "texts/"
        if path.parent == CATALOGUE:
            said |= {(path.stem, name) for name, count in Counter(re.findall(r"\w+", source)).items() if count > 1}
        for names, module in re.findall(rf'import \{{([^}}]*)\}} from "\.[./]*(?:js/)?{folder}(\w+)\.js"', source):
            said |= {(module, name) for name in re.findall(r"\w+", names)}
        for alias, module in re.findall(r'import \* as (\w+) from "\.[./]*texts/(\w+)\.js"', source):
            said |= {(module, name) for name in re.findall(rf"\b{alias}\.(\w+)", source)}
            for names in re.findall(rf"const \{{([^}}]*)\}} = {alias};", source):
                said |= {(module, name) for name in re.findall(r"\w+", names)}
    assert len(exported) > 50
    assert exported - said == set()


def words_of(page: str) -> list[str]:
    """What is read in a page's markup: texts, titles and names for who can't see."""
    markup = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.S)
    told = re.findall(r'\b(?:title|aria-label|placeholder)="([^"]*)"', markup)
    return [
        one
        for one in (" ".join(part.split()) for part in [*told, *re.sub(r"<[^>]*>", "\n", markup).split("\n")])
        if one
    ]


def test_words_of_the_player_have_true_signs():
    words = words_of((STATIC / "player/player.html").read_text())
    assert len(words) > 5
    assert [one for one in words if re.search(r"(?:^|[\s(\[,:±])-[\dxyz]", one)] == [], "a hyphen is no minus sign"
    assert [one for one in words if "..." in one] == []


def test_words_of_markup_are_found():
    page = '<p title="a -1">See <b>-2 m</b> at 1-3</p><script>"-5"</script>'
    assert words_of(page) == ["a -1", "See", "-2 m", "at 1-3"]


PLANTED = [
    'toast("Nothing was sent.");',
    'box.textContent = "Held";',
    'box.title = fits ? "" : "stale";',
    'element("button", { ariaLabel: `Row ${row}` });',
    'element("label", {}, box, "Grid");',
    'box.setAttribute("aria-label", "Legs");',
    'act({ text: "Arm", run });',
    "const told = `${one} of ${other}`;",
    "const told = `${metres} m`;",
    "const told = `${degrees}°`;",
    'const WORDS = { "plan a step": 1 };',
    'throw new Error("Refused");',
    "const told = value.toFixed(3);",
]
PLAIN = [
    'import * as words from "./texts/link.js";',
    'element("p", { className: "line plain", textContent: texts.held });',
    "box.style.background = `linear-gradient(to right, ${colours})`;",
    'pen.font = "11px system-ui, sans-serif";',
    'document.querySelector("dialog[open] button");',
    "get(`/sessions/current/plans/${digest}`);",
    "const key = `${id} ${number}`;",
    'box.dataset.state = waits ? "warn" : "good";',
    'box.textContent = open ? "✓" : "–";',
    'if (why === "step by step") go();',
    '// "a comment is no text"',
]


def test_a_text_elsewhere_is_found_and_what_nobody_reads_is_not():
    # alone, and at the end of a module as it is served
    module = (JS / "panels/conn.js").read_text()
    texts = found({one: one for one in PLANTED + PLAIN} | {f"served: {one}": module + one for one in PLANTED + PLAIN})
    lines = {name: [line for one, line, _ in texts if one == name] for name, *_ in texts}
    last = module.count("\n") + 1
    assert lines == {one: [1] for one in PLANTED} | {f"served: {one}": [last] for one in PLANTED}
