"""The page's themes: text can be read on whatever it may lie on. WCAG's contrast, 4.5 : 1; in the sun 7 : 1.

Which colours are written and which lie under text is read from the style sheets, so that a new one is judged as well.
"""

import re
from pathlib import Path

import pytest

CSS = Path(__file__).resolve().parents[2] / "static" / "css"
PLAYER = CSS.parent / "player" / "player.css"
SHEETS = [*(path for path in sorted(CSS.glob("*.css")) if path.name != "themes.css"), PLAYER]
FLOORS = {"dark": 4.5, "light": 4.5, "sunlight": 7.0}
STATES = {"chosen", "chosen-faint", "main", "failing", "alarm"}
"""Surfaces that mark a state. Quiet and coloured text is not written on them, but where ``ALSO`` says so."""
ALSO = {"failing": {"bad"}}
PLAIN = {"text", "strong"}
OWN = {"on-stop": {"stop", "stop-sent"}, "on-fill": {"good", "warn"}}
"""Texts with surfaces of their own."""
FILLS = {"accent", "bad", "good", "warn", "quiet", "strong", "scene"}
"""Backgrounds of bars, meters and marks, and of the scene: no text lies on them, but for ``OWN``."""

Color = tuple[float, float, float, float]


def color(written: str) -> Color:
    digits = written.removeprefix("#")
    r, g, b, a = (int((digits + "ff")[i : i + 2], 16) / 255 for i in range(0, 8, 2))
    return r, g, b, a


def over(top: Color, under: Color) -> Color:
    r, g, b = (top[3] * one + (1 - top[3]) * other for one, other in zip(top[:3], under[:3], strict=True))
    return r, g, b, 1.0


def luminance(of: Color) -> float:
    r, g, b = (one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in of[:3])
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(one: Color, other: Color) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def themes() -> dict[str, dict[str, Color]]:
    text = (CSS / "themes.css").read_text()
    found: dict[str, dict[str, Color]] = {}
    for selector, body in re.findall(r"^(:root\S*) \{(.*?)^\}", text, re.M | re.S):
        name = re.sub(r':root(\[data-theme="(\w+)"\])?', r"\2", selector) or "dark"
        written = {one: color(value) for one, value in re.findall(r"--([\w-]+): (#\w+);", body)}
        found[name] = {**found.get("dark", {}), **written}
    return found


def written(declaration: str) -> set[str]:
    texts = "\n".join(path.read_text() for path in SHEETS)
    values = re.findall(rf"(?<![\w-]){declaration}: ([^;}}]*)", texts)
    return {name for value in values if "gradient" not in value for name in re.findall(r"var\(--([\w-]+)\)", value)}


def pairs() -> list[tuple[str, str]]:
    texts = written("color") - set(OWN)
    surfaces = (written("background") | {"ground"}) - FILLS - {one for several in OWN.values() for one in several}
    found = [
        (text, surface)
        for surface in sorted(surfaces)
        for text in sorted(texts)
        if surface not in STATES or text in PLAIN | ALSO.get(surface, set())
    ]
    return found + [(text, surface) for text, several in OWN.items() for surface in sorted(several)]


def test_contrast_is_the_one_of_wcag():
    black, white = color("#000000"), color("#ffffff")
    assert contrast(black, white) == pytest.approx(21.0)
    assert contrast(white, black) == pytest.approx(21.0)
    # the well-known greys on white that pass and fail by a hair
    assert contrast(color("#767676"), white) == pytest.approx(4.54, abs=0.005)
    assert contrast(color("#777777"), white) == pytest.approx(4.48, abs=0.005)
    assert over(color("#00000080"), white)[:3] == pytest.approx([1 - 128 / 255] * 3)


def test_the_page_knows_these_themes():
    script = (CSS.parent / "js" / "themes.js").read_text()
    offered = re.search(r"THEMES = \[(.*?)\]", script)
    assert offered is not None
    assert re.findall(r'"(\w+)"', offered[1]) == list(FLOORS) == list(themes())


def test_light_themes_give_every_colour_of_their_own_but_what_is_the_same_in_all():
    text = (CSS / "themes.css").read_text()
    dark, light, sunlight = (set(re.findall(r"--([\w-]+):", body)) for body in text.split(":root")[1:])
    assert dark - light == {"scene", "on-stop", "stop", "stop-sent"}
    assert dark - sunlight == {"scene", "on-stop"}
    assert light | sunlight <= dark


def test_every_colour_that_is_used_is_a_theme_s():
    used = {name for path in SHEETS for name in re.findall(r"var\(--([\w-]+)", path.read_text())}
    assert used - set(themes()["dark"]) == {"shape", "hold"}, "these are no colours"


@pytest.mark.parametrize("theme", FLOORS)
def test_text_can_be_read_on_what_it_lies_on(theme: str):
    colors = themes()[theme]
    # what can be seen through lies on a panel; what lies over the scene, on any brightness
    unders = {"overlay": [color("#000000"), color("#ffffff")]}
    low = [
        f"{text} on {surface}: {found:.2f}"
        for text, surface in pairs()
        for under in unders.get(surface, [colors["panel"]])
        if (found := contrast(colors[text], over(colors[surface], under))) < FLOORS[theme]
    ]
    assert len(pairs()) > 60
    assert not low, f"below {FLOORS[theme]} : 1 in {theme}: {'; '.join(low)}"


@pytest.mark.parametrize("theme", FLOORS)
def test_lines_of_plots_stand_out_from_their_panel(theme: str):
    colors = themes()[theme]
    lines = [name for name in colors if re.fullmatch(r"line-\d", name)]
    assert len(lines) == 6
    assert min(contrast(colors[name], colors["panel"]) for name in lines) >= FLOORS[theme]
