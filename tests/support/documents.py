"""What the documents say in code: lines of fenced blocks, and words in backticks."""

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = (
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "examples/README.md")),
    ROOT / "sample_sessions/regressions/README.md",
    *sorted((ROOT / "docs").glob("*.md")),
)
FENCED = re.compile(r"^```\w*\n(.*?)^```$", re.M | re.S)
SPAN = re.compile(r"`([^`]+)`")


def prose(text: str) -> str:
    """A document without its fenced blocks."""
    return FENCED.sub("", text)


def lines_of_code(text: str) -> Iterator[str]:
    """The lines of its fenced blocks, without what is said of them behind ``#``."""
    for block in FENCED.findall(text):
        for line in block.splitlines():
            yield re.split(r"(?:^|\s+)# ?", line)[0].strip()


def spans(text: str) -> Iterator[str]:
    """What stands in backticks."""
    for span in SPAN.findall(prose(text)):
        yield " ".join(span.split())


def code(text: str) -> Iterator[str]:
    """Lines of code and what stands in backticks."""
    yield from lines_of_code(text)
    yield from spans(text)
