"""A session as one HTML file that plays without a server and asks for nothing from elsewhere.

What the session holds goes in as JSON that no markup can end; the script puts it on the page as text. The page's own
policy allows its one script, by its hash, and nothing from any address.
"""

import base64
import hashlib
import html
import json
import re
from collections.abc import Mapping
from typing import Any

from footfall.core.surrogates import spelled_out
from footfall.io.joined_files import joined_script
from footfall.resources import static_folder

_PLACE = re.compile(r"\{\{(\w+)\}\}")
_MARKS = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


def encode(story: Mapping[str, Any]) -> bytes:
    """UTF-8 HTML of a story in terms of JSON; the same story gives the same bytes. ``name`` is its title."""
    static = static_folder()
    page = (static / "player/player.html").read_text()
    style = (static / "css/themes.css").read_text() + (static / "player/player.css").read_text()
    script = joined_script(static / "player/player.js").text
    text = json.dumps(story, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    text = spelled_out(text)  # JSON's own spelling of it
    for mark, written in _MARKS.items():
        text = text.replace(mark, written)
    parts = {
        "hash": base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        "title": html.escape(spelled_out(str(story["name"]))),
        "style": style,
        "script": script,
        "story": text,
    }
    # in one pass: what was put in is not looked through for further places
    return _PLACE.sub(lambda place: parts[place[1]], page).encode()
