"""Takes the guide's pictures from a run of the browser tests: what the documents show is what the tests saw.

``python -m tests.browser.pictures --list`` names the tests that make them, ``python -m tests.browser.pictures`` takes
their pictures into docs/images, ``python -m tests.browser.pictures --before COMMIT`` those that the documents had then
into one sheet.
"""

import io
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from PIL import Image, ImageDraw, ImageFont

_ROOT = Path(__file__).resolve().parents[2]
OUTPUTS = _ROOT / "test-outputs" / "screenshots"
IMAGES = _ROOT / "docs" / "images"
BEFORE = IMAGES / "before.png"
"""The sheet of what they showed before."""
COLORS = (256, 128, 64)
MOST_BYTES, MOST_IN_ALL = 120_000, 1_500_000


class Picture(NamedTuple):
    """name: in docs/images, without its ending; file: of tests/browser; test: in it, with its case; look: its own
    name for it.

    part: left, top, right, bottom of what is kept of it; None: all.
    """

    name: str
    file: str
    test: str
    look: str
    part: tuple[int, int, int, int] | None = None

    @property
    def taken(self) -> Path:
        """Where a test run leaves it."""
        return OUTPUTS / f"{self.test}-{self.look}.png"

    @property
    def kept(self) -> Path:
        """Where the documents have it."""
        return IMAGES / f"{self.name}.png"


SIDE, SCENE = (851, 93, 1280, 720), (0, 93, 851, 645)
_STEP = "test_page.py", "test_the_first_step_of_the_readme[True]"

PICTURES = (
    Picture("page", *_STEP, "4-planned"),
    Picture("walk", "test_walk_pictured.py", "test_a_planned_walk_lies_on_the_ground", "half-way"),
    Picture("rappel", "test_walk_pictured.py", "test_a_walk_on_a_tether[rappel]", "half-way", SCENE),
    Picture("ground", *_STEP, "2-coloured", SCENE),
    Picture("moving", *_STEP, "5-moving"),
    Picture(
        "images",
        "test_images.py",
        "test_a_click_on_the_ground_in_an_image_chooses_the_footfall",
        "plan-and-grid",
        (487, 93, 1280, 680),
    ),
    Picture("in-hand", "test_hand_in_scene.py", "test_the_footfall_is_dragged_along_the_ground", "dragged", SCENE),
    Picture("alternatives", "test_plan_control.py", "test_alternatives_are_compared_and_chosen", "alternatives", SIDE),
    Picture("outlines", "test_gauge.py", "test_outlines_and_hatching_lie_on_the_ground", "drawn", SCENE),
    Picture("failing", "test_page.py", "test_an_edit_that_breaks_a_rule_is_marked_and_can_be_undone", "failing", SIDE),
    Picture(
        "stopped",
        "test_page.py",
        "test_stop_is_above_a_dialog_and_shows_sent_and_acknowledged",
        "stopped",
        (0, 0, 1280, 58),
    ),
    Picture(
        "conn",
        "test_conn.py",
        "test_the_conn_is_seen_requested_granted_and_kept_over_a_reload",
        "asked",
    ),
    Picture(
        "far",
        "test_far_rover.py",
        "test_light_time_faults_and_the_way_of_a_stop_are_shown",
        "stop-on-its-way",
        (0, 0, 1280, 58),
    ),
    Picture("timeline", "test_console.py", "test_the_timeline_leads_back_to_what_was_planned_and_takes_notes", "plan"),
    Picture("player", "test_console.py", "test_an_exported_page_plays_without_a_server", "player"),
)


SITUATIONS = tuple(one for one in PICTURES if one.name not in ("stopped", "walk", "rappel"))
"""Those of the sheet and of docs/console.md, in its order: a stop is in sight in each, and of a walk was no picture."""
CELL, ACROSS = (316, 216), 4
"""Of the sheet: width and height of a picture [px], pictures in a row."""


def tests() -> Iterator[str]:
    """The tests that make them, as pytest names them."""
    return iter(dict.fromkeys(f"tests/browser/{one.file}::{one.test}" for one in PICTURES))


def keep(picture: Picture) -> int:
    """Take one in; its size [bytes]. Raises SystemExit where no run left it."""
    if not picture.taken.is_file():
        raise SystemExit(f"{picture.taken.name} is not there: run tests/browser/{picture.file}::{picture.test} first")
    with Image.open(picture.taken) as seen:
        part = seen.convert("RGB").crop(picture.part or (0, 0, *seen.size))
    return kept(part, picture.kept)


def sheet(commit: str) -> int:
    """What the documents had of each situation at that commit, small and numbered, as one picture; its size [bytes]."""
    width, height = CELL
    found = Image.new("RGB", (ACROSS * width, -(-len(SITUATIONS) // ACROSS) * height))
    for i, one in enumerate(SITUATIONS):
        then = ["git", "show", f"{commit}:{one.kept.relative_to(_ROOT)}"]
        with Image.open(io.BytesIO(subprocess.run(then, check=True, capture_output=True).stdout)) as seen:
            small = seen.convert("RGB")
        small.thumbnail((width - 4, height - 4), Image.Resampling.LANCZOS)
        left, top = i % ACROSS * width, i // ACROSS * height
        found.paste(small, (left, top))
        # below on the left: most of the pictures have nothing to read there
        label = ImageDraw.Draw(found)
        label.rectangle((left, top + height - 28, left + 26, top + height - 4), fill="black")
        label.text((left + 5, top + height - 26), str(i + 1), "white", ImageFont.load_default(16))
    return kept(found, BEFORE)


def kept(part: Image.Image, path: Path) -> int:
    """Write it with as many colours as fit; its size [bytes]. Raises SystemExit where the fewest are too many."""
    for colors in COLORS:
        # so that the few pixels of a sign keep their colour
        few = part.quantize(colors, Image.Quantize.MAXCOVERAGE, kmeans=4, dither=Image.Dither.NONE)
        few.save(path, optimize=True)
        size = path.stat().st_size
        if size <= MOST_BYTES:
            return size
    raise SystemExit(f"{path.name} has {size} bytes, {MOST_BYTES} are allowed")


if __name__ == "__main__":
    if sys.argv[1:] == ["--list"]:
        sys.stdout.write("\n".join(tests()) + "\n")
    elif sys.argv[1:2] == ["--before"]:
        sys.stdout.write(f"{len(SITUATIONS)} pictures on a sheet, {sheet(sys.argv[2])} bytes\n")
    else:
        sys.stdout.write(f"{len(PICTURES)} pictures, {sum(keep(one) for one in PICTURES)} bytes\n")
