"""Rows of the command list: chosen, moved, split, joints turned; every edit is checked at once and can be undone."""

from playwright.sync_api import Page, Route, expect

from footfall.planning.step.problem import StepSettings
from footfall.session.products.kinds import EDIT
from tests.support.page_steps import RIGID
from tests.support.server import Running
from tests.support.spoken import current
from tests.support.waiting import until

DRAWN = "async () => (await import('/js/page.js')).modules['store.js'].changed()"


def commands(quiet: Running) -> list[dict]:
    with quiet.client() as client:
        return client.get("/sequences/current").json()["commands"]


def held_back(console: Page) -> list[Route]:
    """The edits that the page asks for, to be let go by hand."""
    waiting: list[Route] = []
    console.route(
        "**/sequences/*", lambda one: waiting.append(one) if one.request.method == "PATCH" else one.continue_()
    )
    return waiting


@RIGID
def test_a_row_is_split_moved_and_undone(console: Page, quiet: Running) -> None:
    before = commands(quiet)
    expect(console.locator("#row-edit")).to_be_hidden()
    console.get_by_role("button", name="Row 3", exact=True).click()
    expect(console.locator("#row-title")).to_have_text(f"Row 3: LEG_MOVE leg 4, {before[2]['phase']}")
    console.get_by_role("button", name="Split", exact=True).click()
    until(lambda: len(commands(quiet)) == len(before) + 1, "two halves")
    halves = commands(quiet)[2:4]
    assert [one["duration"] for one in halves] == [before[2]["duration"] / 2] * 2
    assert halves[1]["joints"] == before[2]["joints"]
    console.get_by_role("button", name="Wait before", exact=True).click()
    until(lambda: commands(quiet)[2]["name"] == "WAIT", "a pause")
    console.get_by_role("button", name="Down", exact=True).click()
    until(lambda: commands(quiet)[3]["name"] == "WAIT", "the pause between the halves")
    expect(console.get_by_role("button", name="Row 4", exact=True)).to_have_attribute("aria-pressed", "true")
    console.get_by_role("button", name="Delete", exact=True).click()
    until(lambda: len(commands(quiet)) == len(before) + 1, "no pause")
    for _ in range(4):
        held = commands(quiet)
        console.get_by_role("button", name="Undo", exact=True).click()
        until(lambda held=held: commands(quiet) != held, "one edit undone")
    assert commands(quiet) == before
    console.locator("#h-commands").click()  # focus away from buttons
    console.keyboard.press("Control+y")
    until(lambda: len(commands(quiet)) == len(before) + 1, "the first edit again")
    expect(console.locator("#commands tbody tr")).to_have_count(len(before) + 1)
    console.keyboard.press("Control+z")
    until(lambda: commands(quiet) == before, "without it")


def test_of_a_step_with_the_pose_held_each_row_says_which_leg_steps(console: Page, quiet: Running) -> None:
    assert commands(quiet)[2]["leg"] is None
    leg = console.locator("#commands tbody tr").nth(2).locator("td").nth(2)
    expect(leg).to_have_text("2")
    expect(leg).to_have_attribute("title", "Leg 2 steps")
    console.get_by_role("button", name="Row 3", exact=True).click()
    expect(console.locator("#row-title")).to_have_text(f"Row 3: POSTURE_MOVE leg 2, {commands(quiet)[2]['phase']}")


@RIGID
def test_a_row_is_copied_and_the_copy_changed(console: Page, quiet: Running) -> None:
    before = commands(quiet)
    console.get_by_role("button", name="Row 3", exact=True).click()
    console.get_by_role("button", name="Copy", exact=True).click()
    until(lambda: len(commands(quiet)) == len(before) + 1, "the copy")
    assert commands(quiet)[2:4] == [before[2], before[2]]
    expect(console.get_by_role("button", name="Row 4", exact=True)).to_have_attribute("aria-pressed", "true")
    field = console.get_by_label("hip yaw of row 4 [rad]", exact=True)
    field.fill(f"{before[2]['joints'][0] + 0.01:.4f}")
    field.press("Enter")
    until(lambda: commands(quiet)[3] != before[2], "the change")
    assert commands(quiet)[2] == before[2]
    assert commands(quiet)[3]["joints"][1:] == before[2]["joints"][1:]


def test_what_was_typed_stays_until_the_server_has_answered(console: Page, quiet: Running) -> None:
    waiting = held_back(console)
    console.get_by_role("button", name="Row 2", exact=True).click()
    first, joint = console.get_by_label("Seconds of row 1", exact=True), console.locator("#row-joints input").first
    before, turned = commands(quiet)[0]["duration"], joint.input_value()
    first.fill("9")
    first.press("Enter")
    until(lambda: console.evaluate(DRAWN) or waiting, "the page's question")
    expect(first).to_have_value("9")
    assert commands(quiet)[0]["duration"] == before
    waiting.pop().continue_()
    until(lambda: commands(quiet)[0]["duration"] == 9, "the edit")
    expect(first).to_have_value("9.000")
    # refused, it is as it was
    joint.fill("0.1234")
    joint.press("Enter")
    until(lambda: console.evaluate(DRAWN) or waiting, "the page's question")
    expect(joint).to_have_value("0.1234")
    waiting.pop().fulfill(status=409, json={"detail": "not now"})
    expect(console.locator("#toast")).to_contain_text("not now")
    expect(joint).to_have_value(turned)


@RIGID
def test_a_field_that_is_emptied_is_no_zero(console: Page, quiet: Running) -> None:
    before = commands(quiet)
    console.get_by_role("button", name="Row 3", exact=True).click()
    for label in ("Seconds of row 3", "knee pitch of row 3 [rad]"):
        field = console.get_by_label(label, exact=True)
        there = field.input_value()
        field.fill("")
        field.press("Enter")
        expect(console.locator("#toast")).to_have_text(f"{label}: no number was typed, so nothing was changed.")
        expect(field).to_have_value(there)
    assert commands(quiet) == before


@RIGID
def test_what_is_pressed_twice_in_haste_deletes_one_row(console: Page, quiet: Running) -> None:
    before, waiting = commands(quiet), held_back(console)
    delete = console.get_by_role("button", name="Delete row 3", exact=True)
    delete.click()
    delete.click()  # the list still shows the row
    until(lambda: console.evaluate(DRAWN) or waiting, "the page's question")
    waiting.pop().continue_()
    expect(console.locator("#toast")).to_contain_text("the rows have other numbers by now")
    expect(console.locator("#commands tbody tr")).to_have_count(len(before) - 1)
    assert not waiting
    assert commands(quiet) == [*before[:2], *before[3:]]


@RIGID
def test_seconds_that_are_typed_while_rows_move_are_no_other_rows(console: Page, quiet: Running) -> None:
    before, waiting = commands(quiet), held_back(console)
    console.get_by_role("button", name="Delete row 1", exact=True).click()
    seconds = console.get_by_label("Seconds of row 3", exact=True)
    seconds.fill("9")
    seconds.press("Enter")
    until(lambda: console.evaluate(DRAWN) or waiting, "the page's question")
    waiting.pop().continue_()
    expect(console.locator("#toast")).to_contain_text("the rows have other numbers by now")
    expect(console.locator("#commands tbody tr")).to_have_count(len(before) - 1)
    assert not waiting
    assert commands(quiet) == before[1:]


@RIGID
def test_a_row_that_is_moved_twice_in_haste_goes_two_up(console: Page, quiet: Running) -> None:
    before, waiting = commands(quiet), held_back(console)
    console.get_by_role("button", name="Row 4", exact=True).click()
    up = console.get_by_role("button", name="Up", exact=True)
    up.click()
    up.click()
    for _ in range(2):
        until(lambda: console.evaluate(DRAWN) or waiting, "the page's question")
        waiting.pop().continue_()
    expect(console.get_by_role("button", name="Row 2", exact=True)).to_have_attribute("aria-pressed", "true")
    after = commands(quiet)
    assert [one["duration"] for one in after[:4]] == [before[i]["duration"] for i in (0, 3, 1, 2)]
    assert after[1]["joints"] == before[3]["joints"]


@RIGID
def test_the_chosen_row_stays_the_same_one_where_rows_before_it_come_and_go(console: Page, quiet: Running) -> None:
    phase = commands(quiet)[2]["phase"]
    console.get_by_role("button", name="Row 3", exact=True).click()
    title = console.locator("#row-title")
    expect(title).to_have_text(f"Row 3: LEG_MOVE leg 4, {phase}")
    console.locator("#insert-wait").click()
    expect(title).to_have_text(f"Row 4: LEG_MOVE leg 4, {phase}")
    console.get_by_role("button", name="Delete row 1", exact=True).click()
    expect(title).to_have_text(f"Row 3: LEG_MOVE leg 4, {phase}")


@RIGID
def test_a_joint_beyond_its_limit_is_marked(console: Page, quiet: Running) -> None:
    before = commands(quiet)
    console.get_by_role("button", name="Row 3", exact=True).click()
    field = console.get_by_label("knee pitch of row 3 [rad]", exact=True)
    expect(field).to_have_value(f"{before[2]['joints'][2]:.4f}")
    field.fill("9")
    field.press("Enter")
    until(lambda: commands(quiet)[2]["joints"][2] == 9, "the edit")
    row = console.locator("#commands tbody tr").nth(2)
    expect(row).to_have_class("failing")
    expect(row).to_contain_text("knee_pitch")
    expect(console.get_by_role("button", name="Arm", exact=True)).to_be_disabled()
    console.get_by_role("button", name="Undo", exact=True).click()
    until(lambda: commands(quiet) == before, "what was there first")
    expect(field).to_have_value(f"{before[2]['joints'][2]:.4f}")


@RIGID
def test_a_collision_that_was_edited_in_is_marked_and_shown_by_the_ghost(console: Page, quiet: Running) -> None:
    live = current(quiet)
    while live.state.sequence and live.state.kind_of(live.state.sequence) is EDIT:
        live.sequences.undo()
    expect(console.locator("#scrub-read")).to_contain_text("of the plan")
    before = commands(quiet)
    last = len(before)
    console.get_by_role("button", name=f"Row {last}", exact=True).click()
    field = console.get_by_label(f"hip pitch of row {last} [rad]", exact=True)
    field.fill(f"{before[-1]['joints'][1] + 0.2:.4f}")
    field.press("Enter")
    row = console.locator("#commands tbody tr").nth(last - 1)
    expect(row).to_have_class("failing")
    expect(row).to_contain_text("terrain")
    expect(console.locator("#sequence-text")).to_contain_text(f"row {last}: ")
    expect(console.get_by_role("button", name="Arm", exact=True)).to_be_disabled()
    # what is looked at is what would be sent
    expect(console.locator("#scrub-read")).to_contain_text("of the commands")
    console.get_by_role("button", name="Undo", exact=True).click()
    until(lambda: commands(quiet) == before, "what was there first")
    expect(console.locator("#scrub-read")).to_contain_text("of the plan")


def test_commands_of_another_plan_are_marked(console: Page, quiet: Running) -> None:
    live = quiet.sessions.current
    assert live is not None
    other = console.locator("#sequence-other")
    expect(other).to_be_hidden()
    footfall = live.state.footfall
    assert footfall is not None
    try:
        live.plans.step(footfall.leg, (footfall.x, footfall.y), StepSettings(lift=0.25)).finish()
        expect(other).to_contain_text("These commands belong to another plan")
        live.sequences.make(as_commanded=True)
        expect(other).to_be_hidden()
    finally:
        live.plans.step(footfall.leg, (footfall.x, footfall.y)).finish()
        live.sequences.make(as_commanded=True)
