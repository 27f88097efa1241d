"""Commanding for sag on the page: the order, what is predicted, refusals, out-of-date answers, commands and ghost."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from footfall.sequence.commands import Sequence
from tests.support.page_steps import RIGID, commanded, held, planned, press, sequenced
from tests.support.server import Running
from tests.support.spoken import current
from tests.support.waiting import until

Keep = Callable[[str], None]


@pytest.fixture
def plan(page: Page, served: Running) -> dict:
    """A step as it is planned with what the server calls its defaults."""
    return planned(page, served, lambda: press(page, "Plan step"))


def figure(page: Page, name: str) -> Locator:
    return page.locator("#execution-figures tr", has_text=name).locator("td")


def in_view(page: Page) -> None:
    page.locator("#panel-execution").evaluate("panel => panel.scrollIntoView()")


def test_what_is_predicted_is_shown_and_made_into_commands(page: Page, served: Running, plan: dict, look: Keep) -> None:
    answer = commanded(page, served, lambda: press(page, "Predict sag"))
    assert answer["status"] == "found", answer["reason"]
    assert answer["settings"]["mode"] == "pose_held"
    assert answer["parents"]["plan"] == plan["plan"]["digest"]
    done, figures = answer["execution"], answer["figures"]
    expect(page.locator("#execution-lift")).to_have_class("yes")
    expect(figure(page, "Lowest in the swing")).to_have_text(
        f"{figures['clearance']:.3f} m above the ground, "
        f"{figures['clearance_uncertainty']:.3f} m less with springs 20 % softer"
    )
    expect(figure(page, "Commanded lift")).to_have_text(f"{plan['plan']['provenance']['settings']['lift']:.3f} m")
    expect(figure(page, "Touch-down")).to_have_text(f"{figures['touch_down_offset']:.3f} m from the planned contact")
    expect(figure(page, "Friction used")).to_have_text(f"{100 * figures['friction_use']:.1f} % at most")
    expect(figure(page, "It takes")).to_have_text(f"{figures['seconds']:.1f} s")
    # the lean of the chassis by a second way: the angle of the turn that takes its first up to the others
    ups = np.array(done["Ts_site_base"])[:, :3, 2]
    lean = np.degrees(np.arctan2(np.linalg.norm(np.cross(ups[0], ups), axis=1), ups @ ups[0]).max())
    expect(figure(page, "Chassis")).to_have_text(f"sags {max(figures['sag']):.3f} m, tilts {lean:.2f}° at most")
    loads = np.array(done["loads"])
    rows = page.locator("#execution-loads tbody tr")
    expect(rows).to_have_count(loads.shape[1])
    for leg, row in enumerate(rows.all()):
        told = [
            f"{leg} moves" if leg == done["leg"] else f"{leg}",
            f"{loads[:, leg].min():.0f}",
            f"{loads[:, leg].max():.0f}",
        ]
        assert row.locator("th, td:not(.load)").all_inner_texts() == told
        bar, box = row.locator("i").bounding_box(), row.locator(".load").bounding_box()
        assert bar is not None
        assert box is not None
        share = (loads[:, leg].max() - loads[:, leg].min()) / loads.max()
        assert bar["width"] == pytest.approx(max(2.0, share * box["width"]), abs=2.0)
    in_view(page)
    look("predicted")
    page.get_by_text("Checks of the prediction", exact=True).click()
    checks = page.locator("#execution-checks tbody tr")
    expect(checks).to_have_count(len(answer["checks"]))
    for row, check in zip(checks.all(), answer["checks"], strict=True):
        cells = row.locator("td").all_inner_texts()
        assert cells == [check["name"], f"{check['margin']:.3f} {check['unit']}", check["where"]]

    sequence = sequenced(served, lambda: press(page, "Compensate for sag"))
    assert sequence["parents"]["execution"] == done["digest"]
    expect(page.locator("#commands tbody tr")).to_have_count(len(sequence["commands"]))
    expect(page.locator("#sequence-text")).to_contain_text("Every rule holds.")
    page.locator("#scrub").fill("600")
    expect(page.locator("#scrub-read")).to_contain_text("60 % of the commands")
    until(lambda: held(served)["view"]["scrub"] == 0.6, "the ghost's place")
    look("commands")


def test_a_scrubber_that_has_the_keys_says_what_is_played_now(page: Page, served: Running, plan: dict) -> None:
    page.locator("#scrub").fill("600")
    told = page.locator("#scrub-read")
    expect(told).to_contain_text("60 % of the plan")
    expect(told).not_to_contain_text("row")
    expect(page.locator("#scrub")).to_be_focused()
    live = current(served)
    sequence = live.get(live.sequences.make())
    assert isinstance(sequence, Sequence)
    expect(told).to_have_text(re.compile(rf"60 % .* row \d+ of {len(sequence.commands)}$"))
    expect(page.locator("#scrub")).to_be_focused()


def test_a_refusal_says_why_and_makes_no_commands(page: Page, served: Running, plan: dict, look: Keep) -> None:
    page.locator("#execution-settings-box summary").click()
    page.locator("#sag-least_clearance").fill("0.5")
    page.locator("#execution-mode").select_option("pose_held")
    expect(page.locator("#execution-mode-text")).to_contain_text("The standing legs are commanded too")
    answer = commanded(page, served, lambda: press(page, "Predict sag"))
    assert (answer["status"], answer["settings"]["mode"]) == ("no_path", "pose_held")
    assert answer["settings"]["least_clearance"] == 0.5
    said = page.locator("#execution-answer")
    expect(said).to_have_class("no")
    expect(said).to_have_text(f"Not to be sent, pose held: {answer['reason']}")
    assert "ask for a higher lift" in answer["reason"]
    # the check that failed is in sight without another click, and what is predicted is there to be looked at
    failed = page.locator("#execution-checks td.no")
    expect(failed).to_have_text(["wheel clearance"])
    expect(failed).to_be_visible()
    expect(page.locator("#execution-figures")).to_be_visible()
    expect(page.locator("#make-execution")).to_be_disabled()
    in_view(page)
    look("refused")
    # what makes no sense is refused in words, and the answer stays
    page.locator("#sag-joint_scale").fill("0")
    press(page, "Predict sag")
    expect(page.locator("#toast")).to_contain_text("joint_scale must be between")
    assert held(served)["execution"]["digest"] == answer["digest"]


def test_a_wheel_that_will_not_leave_the_ground_is_told(console: Page, quiet: Running, look: Keep) -> None:
    console.get_by_text("Settings", exact=True).click()
    console.locator("#set-lift").fill("0.1")
    console.locator("#set-raise_terrain").fill("0.02")
    planned(console, quiet, lambda: press(console, "Plan step"))
    console.locator("#execution-settings-box summary").click()
    console.locator("#sag-joint_scale").fill("0.35")
    console.locator("#sag-most_lift").fill("0.1")
    console.locator("#execution-mode").select_option("as_commanded")
    answer = commanded(console, quiet, lambda: press(console, "Predict sag"))
    assert answer["settings"]["compliance"]["joint_scale"] == 0.35
    lacking = -answer["figures"]["clearance"]
    assert lacking > 0
    told = console.locator("#execution-lift")
    expect(told).to_have_class("no")
    expect(told).to_have_text(
        f"The wheel will not leave the ground: lifted by 0.100 m, it is still {lacking:.3f} m too low."
    )
    expect(console.locator("#make-execution")).to_be_disabled()
    in_view(console)
    look("too-soft")


@RIGID
def test_by_keyboard_alone_and_out_of_date_after_another_plan(console: Page, quiet: Running, look: Keep) -> None:
    console.locator("#h-plan").click()  # focus away from fields
    console.keyboard.press("r")
    expect(console.locator("#toast")).to_contain_text("There is no prediction that can be commanded")
    planned(console, quiet, lambda: console.keyboard.press("p"))
    first = commanded(console, quiet, lambda: console.keyboard.press("b"))
    assert first["status"] == "found", first["reason"]
    for _ in range(20):
        console.keyboard.press("[")
    until(lambda: held(quiet)["view"]["scrub"] == pytest.approx(0.6), "the ghost's place")
    before = held(quiet)["sequence"]
    console.keyboard.press("r")
    until(lambda: held(quiet)["sequence"] != before, "the commands")
    assert held(quiet, f"/sequences/{held(quiet)['sequence']}")["parents"]["execution"] == first["execution"]["digest"]
    # the mode by keys too
    console.locator("#execution-mode").focus()
    for key in ("ArrowDown", "ArrowDown", "Enter"):  # the first opens the list
        console.keyboard.press(key)
    expect(console.locator("#execution-mode-text")).to_contain_text("The leg is commanded so that its wheel goes")
    # another plan: what is shown is for the one before, and no commands are made of it
    console.locator("#seed").fill("2")
    console.locator("#h-plan").click()
    another = planned(console, quiet, lambda: console.keyboard.press("p"))
    assert another["plan"]["digest"] != first["parents"]["plan"]
    expect(console.locator("#execution-doubt")).to_contain_text("Out of date: this is for another plan")
    expect(console.locator("#make-execution")).to_be_disabled()
    in_view(console)
    look("out-of-date")
    second = commanded(console, quiet, lambda: console.keyboard.press("b"))
    assert second["settings"]["mode"] == "droop_aware"
    expect(console.locator("#execution-doubt")).to_be_hidden()


def test_commands_are_made_with_the_pose_held_unless_an_expert_says_otherwise(console: Page, quiet: Running) -> None:
    planned(console, quiet, lambda: press(console, "Plan step"))
    expect(console.locator("#way-text")).to_have_text("pose held: the rover's sag is predicted")
    held_so = sequenced(quiet, lambda: press(console, "Make commands"))
    assert held_so["way"]["mode"] == "pose_held"
    expect(console.locator("#sequence-way")).to_contain_text("pose held: The standing legs")
    expect(console.locator("#sequence-way")).not_to_have_class("doubt")
    console.locator("#as-commanded").check()
    doubt = "as commanded: the rover sags; touch-down is not predicted"
    expect(console.locator("#way-text")).to_have_text(doubt)
    rigid = sequenced(quiet, lambda: press(console, "Make commands"))
    assert rigid["way"] == {"mode": "rigid", "text": doubt, "doubt": True}
    expect(console.locator("#sequence-way")).to_have_text(doubt)
    expect(console.locator("#sequence-way")).to_have_class("doubt")
