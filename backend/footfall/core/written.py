"""Text and numbers as files from outside write them: UTF-8, the digits 0 to 9 and a point.

``float`` of Python takes more (``0.66_5``, digits of every script), which no other program reads so.
"""

import codecs
import re

from footfall.core.misread import Unreadable, not_utf8

_NUMBER = re.compile(
    r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[+-]?(?:nan|inf|infinity)", re.ASCII | re.IGNORECASE
)
_SUSPECT = re.compile(rb"[0-9]_[0-9]|[\x80-\xff]")
_OF_NUMBERS = re.compile(rb"(?:v|vt|vn|f|off|vertex|facet|[+-]?nan|[+-]?inf)\b", re.IGNORECASE)
"""How lines begin that hold numbers behind a word."""
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def utf8_of(content: bytes) -> str:
    """The text of a file, without a byte order mark.

    Args:
        content: its bytes.

    Returns:
        The text.

    Raises:
        Unreadable: it is not UTF-8; says what it is and what would be right.
    """
    require_no_utf16(content)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as err:
        raise Unreadable(not_utf8(err)) from err


def require_no_utf16(content: bytes) -> None:
    """Raise Unreadable for text of two bytes a character, as some editors on Windows save it."""
    if content.startswith(_UTF_16) or (len(content) > 3 and sorted(map(bool, content[:2])) == [False, True]):
        raise Unreadable("it is UTF-16 text; save it as UTF-8")


def number_of(word: str) -> float | None:
    """The number that a word of a file is, NaN and infinities too; None where it is none."""
    return float(word) if _NUMBER.fullmatch(word.strip()) else None


def how_to_write(word: str) -> str:
    """What to put after "'1,5' is no number": how it would be written, as far as that is to tell; else ""."""
    ways = (
        (word, "write it with the digits 0 to 9 and a point"),
        (word.replace(",", "."), "write a point"),
        (word.replace("\u2212", "-"), "write a hyphen for the minus"),
    )
    for meant, how in ways:
        try:
            return f"; {how}: {float(meant)!r}"
        except ValueError:
            continue
    return ""


def require_plain_numbers(content: bytes) -> None:
    """Check the numbers of a text for digits that only Python reads.

    Args:
        content: lines of numbers, also behind a word such as ``v``; other lines and what is behind # are passed over.

    Raises:
        Unreadable: one is written so; names line and number.
    """
    if content.isascii() and b"_" not in content:
        return
    passed = -1
    for found in _SUSPECT.finditer(content):
        if found.start() < passed:
            continue
        start, end = content.rfind(b"\n", 0, found.start()) + 1, content.find(b"\n", found.start())
        passed = len(content) if end < 0 else end
        line = content[start:passed].partition(b"#")[0].strip()
        if line[:1].isalpha() and not _OF_NUMBERS.match(line):
            continue
        for word in re.split(r"[\s,;/\"]+", line.decode("utf-8", "replace")):
            if number_of(word) is None and _python_reads(word):
                number = content.count(b"\n", 0, start) + 1
                raise Unreadable(f"line {number} has {word[:40]!r}, which is no number{how_to_write(word)}")


def _python_reads(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
