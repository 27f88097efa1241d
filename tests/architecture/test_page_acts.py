"""Whatever a button of the page does is an act: it has a name in the palette, and says what stands against it."""

import re
from pathlib import Path

STATIC = Path(__file__).resolve().parents[2] / "static"
INSIDE = {
    "stop": "its own way, which asks nothing first; the palette has 'Stop request'",
    "picture": "a place in the image, chosen by a click; footfalls are typed as well",
    "picture-again": "shown in place of an image that did not come",
    "note-cancel": "closes the dialog that it is in, as Escape does",
}
"""Buttons that are no acts, and why."""


def test_every_button_is_an_act():
    buttons = set(re.findall(r'<button id="([\w-]+)"', (STATIC / "index.html").read_text()))
    scripts = "".join(path.read_text() for path in sorted((STATIC / "js").rglob("*.js")))
    acts = set(re.findall(r'button: "([\w-]+)"', scripts))
    acts |= {one for one in buttons for start in re.findall(r"button: `([\w-]+)\$\{", scripts) if one.startswith(start)}
    assert buttons - acts == set(INSIDE)
    assert len(buttons) > 50
