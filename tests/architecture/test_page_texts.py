"""All that an operator reads from the page's scripts stands in one catalogue, ``static/js/texts``.

What counts as a text is said in ``tests/tools/texts.mjs``, which finds them.
"""

import json
import re

import pytest

from tests.architecture.test_page_acts import STATIC
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
NOT_YET = {
    "acts.js",
    "api.js",
    "cameras.js",
    "choosing.js",
    "edits.js",
    "events.js",
    "fits.js",
    "footmoves.js",
    "holding.js",
    "keys.js",
    "kinds.js",
    "layout.js",
    "login.js",
    "main.js",
    "nextthing.js",
    "palette.js",
    "panels/account.js",
    "panels/age.js",
    "panels/alternatives.js",
    "panels/clearances.js",
    "panels/commands.js",
    "panels/execution.js",
    "panels/footfall.js",
    "panels/gait.js",
    "panels/gauge.js",
    "panels/ghost.js",
    "panels/goal.js",
    "panels/ground.js",
    "panels/hand.js",
    "panels/images.js",
    "panels/legs.js",
    "panels/loop.js",
    "panels/map.js",
    "panels/next.js",
    "panels/outcome.js",
    "panels/plan.js",
    "panels/route.js",
    "panels/row.js",
    "panels/run.js",
    "panels/sessions.js",
    "panels/strip.js",
    "panels/suggest.js",
    "panels/telemetry.js",
    "panels/tether.js",
    "panels/through.js",
    "panels/timeline.js",
    "panels/view.js",
    "panels/walk.js",
    "panels/whatif.js",
    "panels/work.js",
    "picture.js",
    "planning.js",
    "rights.js",
    "rules.js",
    "samples.js",
    "scene.js",
    "stopkeys.js",
    "stream.js",
}
"""Modules whose texts are not in the catalogue yet. It only gets shorter."""


def found(sources: dict[str, str]) -> list[tuple[str, int, str]]:
    """Module, line and text of every text in sources of the page."""
    return [(one["name"], one["line"], one["text"]) for one in json.loads(run("texts.mjs", given=json.dumps(sources)))]


def sources() -> dict[str, str]:
    paths = [path for path in sorted(JS.rglob("*.js")) if CATALOGUE not in path.parents]
    return {name: path.read_text() for path in paths if (name := path.relative_to(JS).as_posix()) not in ELSEWHERE}


def is_none(name: str, text: str) -> bool:
    return any(name == module and text.startswith(begin) for module, begin in NO_TEXTS)


def test_texts_stand_in_the_catalogue():
    texts = [one for one in found(sources()) if not is_none(one[0], one[2])]
    strays = [f"static/js/{name}:{line} {text!r}" for name, line, text in texts if name not in NOT_YET]
    assert not strays, "these belong into static/js/texts:\n" + "\n".join(strays)
    assert {name for name, *_ in texts} == NOT_YET, "these have no texts of their own any more"


def test_every_exception_is_there():
    texts = found(sources())
    for module, begin in NO_TEXTS:
        assert any(name == module and text.startswith(begin) for name, _, text in texts), begin
    assert {name for name in ELSEWHERE if not (JS / name).is_file()} == set()


def test_every_text_of_the_catalogue_is_said():
    exported = {
        (path.stem, name)
        for path in CATALOGUE.glob("*.js")
        for name in re.findall(r"^export (?:const|function) (\w+)", path.read_text(), re.M)
    }
    said = set()
    for path in sorted(JS.rglob("*.js")):
        source = path.read_text()
        if path.parent == CATALOGUE:
            said |= {
                (path.stem, name) for name in re.findall(r"\w+", source) if len(re.findall(rf"\b{name}\b", source)) > 1
            }
        for alias, module in re.findall(r'import \* as (\w+) from "[./]*(?:texts/)?(\w+)\.js"', source):
            said |= {(module, name) for name in re.findall(rf"\b{alias}\.(\w+)", source)}
    assert len(exported) > 50
    assert exported - said == set()


@pytest.mark.parametrize(
    "planted",
    [
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
    ],
)
def test_a_text_elsewhere_is_found(planted):
    assert len(found({"planted.js": planted})) == 1
    # inside a module as it is served too
    module = "panels/conn.js"
    source = (JS / module).read_text()
    where = [line for _, line, _ in found({module: source + planted}) if line > source.count("\n")]
    assert where == [source.count("\n") + 1]


@pytest.mark.parametrize(
    "plain",
    [
        'import * as texts from "./texts/conn.js";',
        'element("p", { className: "line plain", textContent: texts.held });',
        "box.style.background = `linear-gradient(to right, ${colours})`;",
        'pen.font = "11px system-ui, sans-serif";',
        'document.querySelector("dialog[open] button");',
        "get(`/sessions/current/plans/${digest}`);",
        "const key = `${id} ${number}`;",
        'box.dataset.state = waits ? "warn" : "good";',
        'box.textContent = open ? "✓" : "–";',
        '// "a comment is no text"',
    ],
)
def test_what_nobody_reads_is_not(plain):
    assert found({"plain.js": plain}) == []
