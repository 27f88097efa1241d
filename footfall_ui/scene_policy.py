"""Content security policy of viser's page: the two scripts that it consists of, by their hashes, and nothing else.

The page carries one inline script that unpacks a second one from its own attributes: ``p``, base 88, packed by
zstandard, the style sheet's ``ss`` bytes before the script's ``cs``.
"""

import base64
import hashlib
from functools import cache
from html.parser import HTMLParser
from importlib.resources import files

import numpy as np
import zstandard

_DIGITS = "!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
_MOST = 64 << 20
"""Largest unpacked size that is believed [bytes]."""


@cache
def scene_policy() -> str:
    """Of the page that the installed viser ships.

    It compiles WebAssembly whose bindings are made of text (``unsafe-eval``), runs workers from blobs, styles inline.
    """
    page = _Page()
    page.feed((files("viser") / "client/build/index.html").read_text(encoding="utf-8"))
    hashes = " ".join(f"'sha256-{_hash(one)}'" for one in [page.script, _packed(page.given)])
    return (
        f"default-src 'none'; script-src 'self' blob: 'unsafe-eval' {hashes}; worker-src 'self' blob:; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
        "connect-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
    )


class _Page(HTMLParser):
    """The page's one script: its text, and what its attributes give it."""

    def __init__(self) -> None:
        super().__init__()
        self.script = ""
        self.given: dict[str, str] = {}
        self._inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._inside = tag == "script"
        if self._inside:
            self.given = {name.removeprefix("data-"): text or "" for name, text in attrs}

    def handle_endtag(self, tag: str) -> None:
        self._inside = False

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.script += data


def _packed(given: dict[str, str]) -> str:
    styles, script = int(given["ss"]), int(given["cs"])
    unpacked = zstandard.ZstdDecompressor().decompress(_from_base_88(given["p"]), max_output_size=_MOST)
    return unpacked[styles : styles + script].decode()


def _from_base_88(text: str) -> bytes:
    """Five digits hold four bytes; a shorter end holds one byte less than it has digits."""
    values = np.zeros(128, np.int64)
    values[np.frombuffer(_DIGITS.encode(), np.uint8)] = np.arange(len(_DIGITS))
    whole = len(text) // 5 * 5
    groups = values[np.frombuffer(text[:whole].encode(), np.uint8)].reshape(-1, 5)
    numbers = groups @ len(_DIGITS) ** np.arange(4, -1, -1)
    rest = 0
    for digit in text[whole:]:
        rest = rest * len(_DIGITS) + int(values[ord(digit)])
    return numbers.astype(">u4").tobytes() + rest.to_bytes(max(0, len(text) - whole - 1), "big")


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
