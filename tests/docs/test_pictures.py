"""The documents' pictures: there, small, used, and from a test that makes them."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.browser.pictures import BEFORE, IMAGES, MOST_BYTES, MOST_IN_ALL, PICTURES, SITUATIONS, Picture
from tests.browser.pictures import tests as named
from tests.support.waiting import BOUND

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"!\[([^\]]*)\]\(([^)\s]+\.png)\)")


def shown() -> dict[Path, list[str]]:
    """Picture → what stands for it where it can't be seen, in every document that shows it."""
    found: dict[Path, list[str]] = {}
    for document in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for words, address in LINK.findall(document.read_text()):
            found.setdefault((document.parent / address).resolve(), []).append(words)
    return found


def test_every_picture_that_is_shown_is_there_and_every_one_there_is_shown():
    named = set(shown())
    assert {BEFORE, *(one.kept for one in PICTURES)} == named
    assert set(IMAGES.glob("*.png")) == named
    assert len({one.name for one in PICTURES}) == len(PICTURES)


def test_situations_are_told_in_the_order_of_the_sheet():
    """A picture's number on the sheet is that of its row, whose link shows the same situation now."""
    told = re.findall(r"^\| (\d+) \|.*\]\(images/([\w-]+)\.png\) \|", (ROOT / "docs/console.md").read_text(), re.M)
    assert told == [(str(i + 1), one.name) for i, one in enumerate(SITUATIONS)]


@pytest.mark.parametrize("picture", PICTURES, ids=lambda picture: picture.name)
def test_a_test_makes_it(picture: Picture):
    tree = ast.parse((ROOT / "tests" / "browser" / picture.file).read_text())
    tests = [
        one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name == picture.test.partition("[")[0]
    ]
    assert len(tests) == 1, f"{picture.file} has no {picture.test}"
    looks = {
        argument.value
        for call in ast.walk(tests[0])
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in ("look", "look_at")
        for argument in call.args
        if isinstance(argument, ast.Constant)
    }
    assert picture.look in looks


def test_pytest_knows_the_tests_that_are_listed():
    """A case that is added to one changes the name of its picture, too."""
    asked = [*named()]
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *asked]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=BOUND, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
    assert {line for line in found.stdout.splitlines() if "::" in line} == set(asked)


def test_they_are_small_and_say_in_words_what_they_show():
    sizes = {path.name: path.stat().st_size for path in (BEFORE, *(one.kept for one in PICTURES))}
    assert {name: size for name, size in sizes.items() if size > MOST_BYTES} == {}
    assert sum(sizes.values()) <= MOST_IN_ALL
    for one in PICTURES:
        with Image.open(one.kept) as image:
            assert image.width >= 400
    assert [str(path) for path, words in shown().items() if any(len(text) < 20 for text in words)] == []
