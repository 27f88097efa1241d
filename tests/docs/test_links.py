"""Links from document to document lead somewhere, to the heading that they name; none is linked from nowhere."""

import re
from pathlib import Path

import pytest

from tests.support.documents import DOCUMENTS, ROOT, prose

LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.*)$", re.M)


def anchors(text: str) -> set[str]:
    """What headings of a document are linked by, as its reader makes it: small, without signs, a hyphen for a blank."""
    return {re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in HEADING.findall(prose(text))}


def linked(document: Path) -> list[tuple[Path, str]]:
    """Where the links of a document lead, beside those to other sites: files and anchors in them."""
    found = []
    for address in LINK.findall(prose(document.read_text("utf-8"))):
        if not re.match(r"\w+:", address):
            file, _, anchor = address.partition("#")
            found.append(((document.parent / file).resolve() if file else document, anchor))
    return found


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.stem)
def test_links_lead_somewhere(document: Path) -> None:
    wrong = [
        f"{path}#{anchor}"
        for path, anchor in linked(document)
        if not path.exists() or (anchor and anchor not in anchors(path.read_text("utf-8")))
    ]
    assert wrong == []


def test_every_document_is_linked_from_another() -> None:
    led_to = {path for document in DOCUMENTS for path, _ in linked(document) if path != document}
    assert [path.name for path in (ROOT / "docs").glob("*.md") if path not in led_to] == []


def test_anchors_are_those_of_the_headings() -> None:
    assert anchors("# A, b\n## What `check` says\n```\n# no\n```\n### Listening, and resuming\n") == {
        "a-b",
        "what-check-says",
        "listening-and-resuming",
    }
