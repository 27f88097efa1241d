"""What the page says is so at one moment: of a server that is silent, of commands taken back or carried out, of what is
made next."""

import re

import numpy as np
from playwright.sync_api import Page, expect

from tests.support.page_steps import RIGID, figure, held, made, press
from tests.support.server import Running
from tests.support.spoken import current, say
from tests.support.waiting import until

SILENT = """async () => {
  const { changed, known } = (await import("/js/page.js")).modules["store.js"];
  window.fetch = (address, { signal } = {}) => new Promise((_, fail) => signal?.addEventListener("abort", fail));
  known.heardAt -= 38000;
  known.summary = { ...known.summary, terrain: { ...known.summary.terrain, seen: Date.now() / 1000 - 100 } };
  changed();
}"""
"""No request is answered any more, and the last answer is 38 s old; the line of events is open still. The ground was
seen just before."""
SET = """(field, value) => {
  field.value = value;
  for (const type of ["input", "change"]) field.dispatchEvent(new Event(type, { bubbles: true }));
}"""
"""As if it was typed there, in sight or not."""
HOLDS = "Every rule holds."
BROKEN = "a rule does not hold"


def carried_out(quiet: Running) -> None:
    """The present commands, sent to a rover that does every row and stands elsewhere then."""
    live = current(quiet)
    live.rover.connected(lambda text: None)
    say(quiet, 1)
    commands = live.commands.send(live.commands.arm()["token"])["commands"]
    for number, command in enumerate(commands, start=2):
        say(quiet, number)  # a rover that falls silent ends the run
        live.rover.take_acknowledgement(command, "done")
    assert live.rover.frame is not None
    say(quiet, len(commands) + 2, posture=live.rover.frame.state.posture + 0.3)


def test_ages_go_by_the_servers_clock(console: Page, quiet: Running) -> None:
    past, old = "const real = Date.now; Date.now = () => real() - 1e10;", re.compile(r"^[\d.]+ (s|min|h) old$")
    ground = console.locator("#status-ground")
    expect(ground).to_have_text(old)
    state = ground.get_attribute("data-state")
    console.add_init_script(past)
    console.reload()
    expect(ground).to_have_text(old)
    assert ground.get_attribute("data-state") == state


def test_of_a_silent_server_nothing_is_said_to_go_on(console: Page, quiet: Running) -> None:
    console.get_by_role("button", name="Take conn").click()
    conn = console.locator("#status-conn")
    expect(conn).to_have_attribute("data-state", "good")
    note = console.locator("#scene-note")
    expect(note).to_contain_text("stop go on without it")
    console.evaluate(SILENT)
    expect(note).to_contain_text(re.compile(r"The server has been silent for (3|4)\d s"))
    expect(note).not_to_contain_text("go on")
    expect(note).to_have_class("doubt")
    expect(conn).to_have_attribute("data-state", "stale")
    expect(conn).to_contain_text(re.compile(r"^(3|4)\d s ago: this page"))
    expect(console.locator("#conn-text")).to_contain_text("not known, the server has been silent for")
    expect(console.locator("#status-server")).to_contain_text("silent for")
    expect(console.locator("#status-match")).to_have_attribute("data-state", re.compile("stale|warn"))
    ground = console.locator("#status-ground")
    expect(ground).to_have_attribute("data-state", "stale")
    expect(ground).to_have_text(re.compile(r"^\d min old, newer not known$"))
    good = console.locator("header [data-state=good], header [data-state=busy]")
    expect(good).to_have_count(0)


def test_a_run_of_a_silent_server_is_told_with_its_age(console: Page, quiet: Running) -> None:
    live = current(quiet)
    live.rover.connected(lambda text: None)
    say(quiet, 1)
    live.commands.send(live.commands.arm()["token"])
    arm = console.locator("#arm-state")
    expect(arm).to_contain_text("row 1")
    console.evaluate(SILENT)
    expect(arm).to_contain_text(re.compile(r"^(3|4)\d s ago: "))
    expect(arm).to_have_attribute("data-state", "warn")
    expect(console.locator("#status-match")).to_contain_text(re.compile(r"not known for (3|4)\d s"))
    expect(console.locator("#run-state")).to_contain_text("s ago")


def test_a_verdict_goes_with_what_it_judged(console: Page, quiet: Running) -> None:
    text, told = console.locator("#sequence-text"), console.locator("#job-said")
    expect(text).to_contain_text(HOLDS)
    seconds = console.locator("#commands tbody input").first
    seconds.fill("0.001")
    seconds.press("Enter")
    expect(told).to_contain_text(BROKEN)
    expect(text).not_to_contain_text(HOLDS)
    console.locator("#commands tbody input").nth(1).focus()  # the rows wait for who types; the verdict does not
    console.get_by_role("button", name="Undo", exact=True).dispatch_event("click")
    expect(text).to_contain_text(HOLDS)
    expect(told).to_be_hidden()


def test_how_far_a_row_came_is_told_also_while_somebody_types_in_another(console: Page, quiet: Running) -> None:
    live = current(quiet)
    seconds = console.locator("#commands tbody input").nth(3)
    seconds.focus()
    live.rover.connected(lambda text: None)
    say(quiet, 1)
    first, *_ = live.commands.send(live.commands.arm()["token"])["commands"]
    rows = console.locator("#commands tbody tr:not(.group)")
    live.rover.take_acknowledgement(first, "started")
    expect(rows.first).to_have_class("current")
    say(quiet, 2)
    live.rover.take_acknowledgement(first, "done")
    expect(rows.first.locator("td").nth(6)).to_contain_text("done")
    expect(seconds).to_be_focused()


def test_commands_that_were_carried_out_are_not_armed(console: Page, quiet: Running) -> None:
    expect(console.locator("#make-sequence")).to_have_text("Make commands: leg 2, for sag")
    carried_out(quiet)
    count = len(held(quiet, "/sequences/current")["commands"])
    complete = f"Sequence complete ({count} of {count}): make new commands."
    arm = console.locator("#arm")
    expect(arm).to_have_attribute("title", re.compile(rf"^{re.escape(complete)}"))
    expect(arm).to_be_disabled()
    expect(console.locator("#arm-state")).to_contain_text(complete)
    make = console.locator("#make-sequence")
    expect(make).to_be_disabled()
    expect(make).to_have_text("Make commands")
    expect(make).to_have_attribute("title", re.compile("The plan was carried out: plan the next"))


def test_the_button_names_what_it_makes_commands_of_and_makes_that(console: Page, quiet: Running) -> None:
    make = console.locator("#make-sequence")
    expect(make).to_have_text("Make commands: leg 2, for sag")
    console.locator("#panel-what-if summary").click()
    console.locator("#shift-dz").fill("-0.02")
    made(quiet, "body_move", lambda: press(console, "Check the move"))
    expect(make).to_have_text("Make commands: chassis move")
    before = held(quiet)["sequence"]
    console.locator("#h-commands").click()
    console.keyboard.press("s")
    until(lambda: held(quiet)["sequence"] != before, "the commands")
    commands = held(quiet, f"/sequences/{held(quiet)['sequence']}")["commands"]
    # with the pose held, at rest where it ends
    assert {one["name"] for one in commands} == {"POSTURE_MOVE", "WAIT"}
    assert np.shape(commands[0]["joints"]) == (36,)


def test_what_rounds_to_nothing_has_no_sign(console: Page) -> None:
    numbers = [-0.0, -0.0004, -0.0005001, 0.0004, -1e-9, -0.999, -10.0, -0.05, 12.3456]
    said = console.evaluate(
        "async (numbers) => { const { fixed } = (await import('/js/page.js')).modules['dom.js'];"
        " return [0, 2, 3].map((digits) => numbers.map((one) => fixed(one, digits))); }",
        numbers,
    )
    for digits, texts in zip((0, 2, 3), said, strict=True):
        assert texts == [figure(number, digits) for number in numbers]


def test_how_much_is_sent_at_once_outlives_a_reload(console: Page) -> None:
    console.locator("#by-steps").check()
    console.locator("#walk-until").select_option("next")
    console.reload()
    expect(console.locator("#by-steps")).to_be_checked()
    expect(console.locator("#walk-until")).to_have_value("next")
    console.locator("#by-steps").uncheck()
    console.reload()
    expect(console.locator("#walk-until")).to_have_value("next")
    expect(console.locator("#by-steps")).not_to_be_checked()


def test_what_plans_are_judged_by_outlives_a_reload_and_no_other_session(console: Page, quiet: Running) -> None:
    typed = {"payload": "150", "tilt": "5", "uphill": "90", "friction": "0.4", "sag-least_load": "80"}
    typed |= {"set-least_margin": "0.2", "seed": "7", "walk-yaw": "30"}
    typed |= {"loop-most_torque": "0.5", "tether-x": "-3", "tether-length": "12", "weight-slope": "4"}
    chosen = {"gravity": "1.62", "execution-mode": "droop_aware", "walk-gait": "wave"}
    for name in ("planner", "execution-mode"):  # which the server tells
        expect(console.locator(f"#{name} option")).not_to_have_count(0)
    delivered = {name: console.locator(f"#{name}").input_value() for name in (*typed, *chosen)}
    for name, value in typed.items():
        console.locator(f"#{name}").evaluate(SET, value)
    for name, value in chosen.items():
        console.locator(f"#{name}").evaluate(SET, value)
    boxes = ["conservative", "as-commanded", "tether-on"]
    for name in boxes:
        console.locator(f"#{name}").evaluate("box => box.click()")
    console.reload()
    for name, value in (typed | chosen).items():
        expect(console.locator(f"#{name}")).to_have_value(value)
    for name in boxes:
        expect(console.locator(f"#{name}")).to_be_checked()
    expect(console.locator("#execution-mode-text")).not_to_be_empty()
    quiet.sessions.create("another")
    expect(console.locator("#status-session")).to_have_text("another")
    for name, value in delivered.items():
        expect(console.locator(f"#{name}")).to_have_value(value)
    for name in boxes:
        expect(console.locator(f"#{name}")).not_to_be_checked()


@RIGID
def test_commands_are_told_by_how_the_rover_is_known_to_sag_by_now(console: Page, quiet: Running) -> None:
    way = console.locator("#sequence-way")
    expect(way).to_have_class("doubt")
    say(quiet, 1, joint_torques=np.full(36, 50.0))  # its joints bear that, and are where they were told to be
    expect(way).to_have_text("as commanded: telemetry shows that the rover's joints do not give way")
    expect(way).to_have_class("hint")


def test_nothing_is_armed_without_a_rover(console: Page, quiet: Running) -> None:
    arm = console.locator("#arm")
    expect(arm).to_have_attribute("title", "No rover is connected.")
    expect(arm).to_be_disabled()
    current(quiet).rover.connected(lambda text: None)
    expect(arm).to_be_enabled()
