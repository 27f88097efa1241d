"""A file of commands is exported, changed by hand and read in again: what it breaks is marked, and undo brings back."""

import csv
from pathlib import Path

from playwright.sync_api import Page, expect

from tests.support.page_steps import RIGID
from tests.support.server import Running
from tests.support.waiting import until


def commands(quiet: Running) -> dict:
    with quiet.client() as client:
        return client.get("/sequences/current").json()


def import_by_palette(console: Page, path: Path) -> None:
    with console.expect_file_chooser() as chooser:
        console.locator("#h-commands").click()  # focus away from fields
        console.keyboard.press("Control+k")
        console.locator("#palette-input").fill("import")
        console.keyboard.press("Enter")
    chooser.value.set_files(path)


@RIGID
def test_a_row_that_was_changed_into_a_collision_is_marked(console: Page, quiet: Running, tmp_path: Path, look) -> None:
    before = commands(quiet)
    console.get_by_label("Export as").select_option("csv")
    with console.expect_download() as download:
        console.get_by_role("button", name="Export", exact=True).click()
    path = tmp_path / "step.csv"
    download.value.save_as(path)
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    rows[-1][header.index("hip_pitch_rad")] = repr(float(rows[-1][header.index("hip_pitch_rad")]) + 0.2)
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([header, *rows])

    console.locator("#as-commanded").check()  # as the sample's commands were made
    import_by_palette(console, path)
    last = len(before["commands"])
    row = console.locator("#commands tbody tr").nth(last - 1)
    expect(row).to_have_class("failing")
    expect(row).to_contain_text("leg4_wheel cuts 0.087 m into terrain")
    expect(console.locator("#sequence-start")).to_be_visible()
    expect(console.locator("#sequence-start")).to_contain_text("doesn't say where they start")
    expect(console.get_by_role("button", name="Arm", exact=True)).to_be_disabled()
    expect(console.get_by_role("button", name="Export", exact=True)).to_be_disabled()
    expect(console.locator("#timeline-text")).to_contain_text("import")
    look("read-in")

    expect(console.get_by_role("button", name="Undo", exact=True)).to_be_enabled()
    console.locator("#h-commands").click()
    console.keyboard.press("Control+z")
    until(lambda: commands(quiet) == before, "the commands from before")
    expect(console.locator("#sequence-start")).to_be_hidden()
    expect(row).not_to_have_class("failing")


def test_a_file_that_cannot_be_used_is_told_and_can_be_mended(console: Page, quiet: Running, tmp_path: Path) -> None:
    before = commands(quiet)
    path = tmp_path / "step.json"
    path.write_text('{"format": "footfall-sequence", "version": 9}')
    import_by_palette(console, path)
    expect(console.locator("#toast")).to_contain_text("step.json: this FootFall reads version 1 of its JSON, not 9")
    assert commands(quiet) == before
    with quiet.client() as client:
        path.write_bytes(client.get(f"/sequences/{before['digest']}/export", params={"format": "json"}).content)
    import_by_palette(console, path)
    until(lambda: commands(quiet)["starts_from"] == "file", "the mended file")
    after = commands(quiet)
    assert after["commands"] == before["commands"]
    assert after["valid"]
    expect(console.locator("#sequence-text")).to_contain_text("Every rule holds")
    expect(console.locator("#sequence-start")).to_be_hidden()
