"""Plots that a person makes: any channels together, over the whole recording; numbers as the recording has them."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from footfall.io.recordings.reading import Recording
from footfall.telemetry.state import TelemetryFrame
from tests.architecture.test_page_themes import FLOORS
from tests.browser.test_console_access import violations
from tests.support.page_steps import held
from tests.support.server import Running
from tests.support.spoken import current, say_at
from tests.support.waiting import until

PEAK = 321.0
DRAWN = "async id => (await import('/js/page.js')).modules['panels/plots.js'].drawnNumbers(id)"
FRAMES = 60


@pytest.fixture
def said(quiet: Running) -> float:
    """A rover that spoke for a minute, ten minutes ago, with a pause of 20 s; returns when, time.time() [s]."""
    begin = time.monotonic() - 600
    for number in range(1, FRAMES + 1):
        torques = np.zeros(36)
        torques[13] = PEAK if number == 17 else float(number)
        say_at(begin + number + (20 if number > 30 else 0), quiet, number, joint_torques=torques)
    until(lambda: held(quiet, RECORDED)["times"][-1:] and len(held(quiet, RECORDED)["times"]) == FRAMES, "the recorder")
    return time.time() - time.monotonic() + begin


RECORDED = "/sessions/current/telemetry/recorded?channel=torque.13&parts=1000"


def tilt(up: np.ndarray) -> float:
    """How far it leans from the vertical [°]."""
    return float(np.degrees(np.arctan2(np.hypot(up[0], up[1]), up[2])))


def shown(console: Page) -> None:
    console.locator("#layout").select_option("plots")
    expect(console.locator("#panel-plots")).to_be_visible()


def added(console: Page, *channels: str) -> Any:
    """Add a plot with these channels, each found by words; its section."""
    console.locator("#plots-add").click()
    section = console.locator(".composed").last
    for words in channels:
        section.get_by_role("searchbox").fill(words)
        section.locator(".channels input").first.check()
    return section


def drawn(console: Page, plot: int = 1) -> dict[str, Any]:
    return console.evaluate(DRAWN, plot)


def columns_of(console: Page, plot: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Times and numbers that a plot is drawn from, without the breaks of its lines."""
    found = drawn(console, plot)
    times, columns = np.array(found["times"], float), np.array(found["columns"], float)
    kept = np.flatnonzero(np.isfinite(columns[0]))[:FRAMES]  # its last frame a busy page may have told once more
    return times[kept], columns[:, kept]


def test_a_plot_of_several_quantities_has_the_numbers_of_the_recording(
    console: Page, quiet: Running, said: float, athlete, look: Callable[[str], None]
) -> None:
    shown(console)
    plot = added(console, "torque leg 2 hip pitch", "force leg 2", "° tilt")
    until(lambda: len(columns_of(console)[0]) == FRAMES, "the whole recording")
    paths = current(quiet).rover.recorder.paths()
    heard = [one for path in paths for one in Recording(path).said() if isinstance(one.content, TelemetryFrame)]
    states = [one.content.state for one in heard if isinstance(one.content, TelemetryFrame)]
    expected = np.array(
        [
            [state.joint_torques[13] for state in states],
            [state.wheel_forces[2, 2] for state in states],
            [tilt(state.T_site_base[:3, 2]) for state in states],
        ]
    )
    times, columns = columns_of(console)
    assert times == pytest.approx([one.at / 1e9 for one in heard], abs=0.5)  # by this computer's clock
    assert columns == pytest.approx(expected, rel=1e-5, abs=1e-4)
    assert drawn(console)["pauses"][0] == pytest.approx([said + 30, said + 51], abs=0.5)
    gaps = [i for i, one in enumerate(drawn(console)["columns"][0][: FRAMES + 1]) if one is None]
    assert gaps == [30], "no line leads over it"
    limit = f"{athlete.torque_limits[13]:g}"
    expect(plot.locator(".plot-read li").first).to_contain_text(f"−{limit} … {limit} N·m")
    expect(plot.locator(".plot-read li").first).to_contain_text(f"{FRAMES}.0 N·m")
    look("composed")


def test_a_plot_is_zoomed_by_hand_wheel_and_keys_and_read(console: Page, quiet: Running, said: float) -> None:
    shown(console)
    plot = added(console, "torque leg 2 hip pitch")
    until(lambda: len(columns_of(console)[0]) == FRAMES, "the whole recording")
    lines = plot.locator(".plot-lines")
    over = lines.locator(".u-over").bounding_box()
    assert over is not None
    middle = over["y"] + over["height"] / 2
    # the time goes from 1 s to 80 s after the beginning; the peak is after 17 s
    x = [over["x"] + (at - 1) / 79 * over["width"] for at in (10, 24)]
    console.mouse.move(x[0], middle)
    console.mouse.down()
    console.mouse.move(x[1], middle, steps=3)
    console.mouse.up()
    until(lambda: FRAMES > len(columns_of(console)[0]) >= 14, "what was dragged over")
    times, columns = columns_of(console)
    assert times[0] >= said + 8
    assert times[-1] <= said + 26
    assert columns[0].max() == PEAK
    peak = times[columns[0].argmax()]
    expect(console.locator("#plots-shown")).to_have_value("between")

    console.mouse.move(over["x"] + over["width"] / 2, middle)
    console.mouse.wheel(0, 600)
    until(lambda: len(columns_of(console)[0]) > len(times), "out by the wheel")
    lines.focus()
    console.keyboard.press("Home")
    expect(console.locator("#plots-shown")).to_have_value("whole")
    console.keyboard.press("+")
    until(lambda: 0 < len(columns_of(console)[0]) < FRAMES, "in by a key")
    console.keyboard.press("Home")
    until(lambda: len(columns_of(console)[0]) == FRAMES, "all of it by a key")

    # the moment that all panels share, moved frame by frame
    console.evaluate("async at => (await import('/js/page.js')).modules['cursor.js'].point(at)", peak - 1)
    value = plot.locator(".plot-read b")
    expect(value).to_have_text("16.0 N·m")
    console.keyboard.press("Shift+ArrowRight")
    expect(value).to_have_text(f"{PEAK} N·m")
    moment = "async () => (await import('/js/page.js')).modules['cursor.js'].moment()"
    assert console.evaluate(moment) == pytest.approx(peak)


def test_plots_are_named_removed_taken_back_and_kept(console: Page, quiet: Running, said: float) -> None:
    shown(console)
    added(console, "torque leg 2 hip pitch")
    second = added(console, "tilt", "interval")
    name = second.get_by_label("Name of Plot 2")
    name.fill("How it leans")
    name.press("Enter")
    expect(console.get_by_role("button", name="Remove How it leans")).to_be_visible()
    console.reload()
    expect(console.locator(".composed")).to_have_count(2)
    expect(console.locator(".composed").last.locator(".plot-name")).to_have_value("How it leans")
    expect(console.locator(".composed").last.locator(".plot-read li")).to_have_count(2)
    until(lambda: len(columns_of(console)[0]) == FRAMES, "what was recorded before the page was loaded")
    expect(console.locator("#plots-undo")).to_be_disabled()
    console.get_by_role("button", name="Remove Plot 1").click()
    expect(console.locator(".composed")).to_have_count(1)
    expect(console.locator("#plots-undo")).to_be_focused()
    console.keyboard.press("Enter")
    expect(console.locator(".composed")).to_have_count(2)
    expect(console.locator(".composed").first.locator(".plot-read li")).to_have_count(1)
    console.locator(".composed").last.locator(".plot-lines").focus()
    console.keyboard.press("Delete")
    expect(console.locator(".composed")).to_have_count(1)


def test_two_tabs_keep_the_same_plots(console: Page, quiet: Running) -> None:
    shown(console)
    other = console.context.new_page()
    other.goto(console.url)
    shown(other)
    added(console, "tilt")
    expect(other.locator(".composed")).to_have_count(1)
    expect(other.locator(".composed .plot-read li")).to_have_count(1)
    added(other, "force leg 2")
    expect(console.locator(".composed .plot-name")).to_have_count(2)
    expect(console.locator(".composed").last.locator(".plot-read li")).to_have_count(1)
    expect(console.locator("#plots-undo")).to_be_disabled()  # it would take back the other tab's
    console.locator("#plots-shown").select_option("600")
    expect(other.locator("#plots-shown")).to_have_value("whole")
    console.reload()
    expect(console.locator(".composed .plot-read li")).to_have_count(2)


def test_events_of_the_log_are_marked_with_their_words(console: Page, quiet: Running, said: float) -> None:
    current(quiet).add_note("the wheel slipped")
    noted = held(quiet)["notes"][-1]
    shown(console)
    plot = added(console, "torque leg 2 hip pitch")
    now = time.time()
    console.evaluate(
        "async ([begin, end]) => "
        "(await import('/js/page.js')).modules['plots/kept.js'].show({kind: 'between', begin, end})",
        [said - 5, now + 30],
    )
    drawn = "(await import('/js/page.js')).modules['panels/plots.js'].drawnNumbers(1)"
    marked = f"async () => {drawn}.marks.filter(one => one.sign === '✎')"
    until(lambda: console.evaluate(marked), "the mark of the note")
    at = console.evaluate(marked)[-1]["time"]
    assert said < at < now + 30
    console.evaluate("async at => (await import('/js/page.js')).modules['cursor.js'].point(at)", at)
    expect(plot.locator(".plot-event")).to_contain_text("✎")
    expect(plot.locator(".plot-event")).to_contain_text(noted["text"])


def test_channels_are_found_by_leg_quantity_and_unit(console: Page, quiet: Running) -> None:
    shown(console)
    expect(console.locator("#plots-note")).to_have_text("There is no plot yet: add one, then choose its channels.")
    plot = added(console)
    rows = plot.locator(".channels li")
    search = plot.get_by_role("searchbox")
    expect(search).to_be_focused()
    for words, count in (("leg 4", 20), ("torque leg 4", 6), ("N·m leg 4", 6), ("tilt", 1), ("knee torques", 12)):
        search.fill(words)
        expect(rows).to_have_count(count)
    search.fill("no such thing")
    expect(plot.locator(".picker .hint")).to_have_text("No channel has such a name.")
    search.fill("")
    expect(plot.locator(".picker .hint")).to_contain_text("more; type more of the name")
    expect(plot.locator(".plot-note")).to_contain_text("No channel is chosen")


@pytest.mark.parametrize("theme", FLOORS)
def test_axe_finds_nothing_serious_in_plots(
    console: Page, quiet: Running, said: float, theme: str, look: Callable[[str], None]
) -> None:
    console.get_by_label("Theme").select_option(theme)
    shown(console)
    added(console, "torque leg 2", "force leg 2", "tilt")
    until(lambda: len(columns_of(console)[0]) == FRAMES, "the whole recording")
    assert violations(console) == []
    look(theme)
