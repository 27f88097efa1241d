"""The layout for walks, which a new operator gets; cards that open where the job is; areas that float and dock."""

import json
import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from playwright.sync_api import FloatRect, Page, expect

from tests.browser.conftest import opened
from tests.browser.test_console_access import violations
from tests.browser.test_page import COVERED
from tests.support.browsers import Browsers
from tests.support.page_steps import SESSION
from tests.support.server import Running, running_server
from tests.support.waiting import until

Look = Callable[[Page, str], None]
WALK = ["ground", "goal", "walk", "loop", "commands"]
IN_SIGHT = """() => [...document.querySelectorAll("#side > .panel, #dock > .panel")]
  .filter(one => one.checkVisibility()).map(one => one.id.replace("panel-", ""))"""
KEPT = "() => JSON.parse(localStorage['footfall.layout'])"
DRAWN = "async () => (await import('/js/page.js')).modules['store.js'].changed()"
FITTED = (
    "async given => { const { fitted } = (await import('/js/page.js')).modules['layout/room.js']; "
    "return given.map(one => fitted(...one)); }"
)

CUT = """async text => {
  const { known, changed } = (await import("/js/page.js")).modules["store.js"];
  known.jobs.set("job", { id: "job", kind: "walk", state: "running", fraction: 0.3, text });
  changed();
  document.getElementById("log-out").hidden = false; // as where there are accounts
  const isSeen = (one) => {
    const { left, top, right, bottom } = one.getBoundingClientRect();
    const places = [[left + 3, top + 3], [right - 3, top + 3], [left + 3, bottom - 3], [right - 3, bottom - 3]];
    return one.scrollWidth <= one.clientWidth && one.scrollHeight <= one.clientHeight
      && places.every(([x, y]) => one.contains(document.elementFromPoint(x, y)));
  };
  const named = "#job-text, #job-cancel, #open-palette, #log-out, #open-help";
  const parts = [...document.querySelectorAll(`#area-buttons button, ${named}`)];
  return { parts: parts.length, cut: parts.filter((one) => !isSeen(one)).map((one) => one.id) };
}"""
"""Of the bar of areas, and of what is under way, the parts that are cut off or lie under others."""


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """One server for all of them, without rover and scene."""
    with running_server(tmp_path_factory.mktemp("layout"), prepare=lambda s: s.open_sample("rock-step")) as running:
        yield running


@pytest.fixture
def fresh(chromiums: Browsers, quiet: Running) -> Iterator[Page]:
    """The page of a browser that keeps nothing yet, of a session without a goal."""
    with quiet.client() as client:
        client.put(f"{SESSION}/view", json={"goal": None}).raise_for_status()
    with opened(chromiums(False), quiet, "scene=off", layout=None) as page:
        expect(page.locator("#next-act")).to_have_text("Take images")
        yield page


def box(page: Page, selector: str) -> FloatRect:
    found = page.locator(selector).bounding_box()
    assert found is not None
    return found


def stop_is_clear(page: Page) -> None:
    """Nothing lies over the middle of STOP."""
    at = box(page, "#stop")
    middle = [at["x"] + at["width"] / 2, at["y"] + at["height"] / 2]
    assert page.evaluate("([x, y]) => document.elementFromPoint(x, y).id", middle) == "stop"


def keeps_its_place(page: Page, name: str) -> None:
    """It floats inside the scene, below the legs' bar, and STOP is clear."""
    area, scene, legs = box(page, f"#panel-{name}"), box(page, ".scene"), box(page, "#legs")
    assert scene["x"] <= area["x"]
    assert area["x"] + area["width"] <= scene["x"] + scene["width"]
    assert legs["y"] + legs["height"] <= area["y"]
    assert area["y"] + area["height"] <= scene["y"] + scene["height"]
    stop_is_clear(page)


def find_act(page: Page, typed: str) -> None:
    page.keyboard.press("Control+k")
    page.locator("#palette-input").fill(typed)
    page.keyboard.press("Enter")


# -- the layout for walks --------------------------------------------------------------------------


def test_a_new_operator_gets_the_layout_for_walks(fresh: Page, look_at: Look) -> None:
    expect(fresh.locator("#layout")).to_have_value("walk")
    assert fresh.evaluate(IN_SIGHT) == WALK
    numbers = fresh.locator("#side > .panel:not([hidden]) > h2 > span").all_text_contents()
    assert numbers == ["1", "2", "3", "4"]
    for width, height in ((1280, 720), (1920, 1080)):
        fresh.set_viewport_size({"width": width, "height": height})
        seen = fresh.evaluate(COVERED)
        assert seen["outside"] == seen["over"] == [], seen
        scene = box(fresh, ".scene")
        assert scene["width"] * scene["height"] > 0.45 * width * height
        for part in ("#next-act", "#walk-until", "#scrub", "#timeline-text", "#h-ground", "#h-commands"):
            expect(fresh.locator(part)).to_be_in_viewport(ratio=1)
        assert fresh.evaluate("() => document.getElementById('area-buttons').offsetHeight") < 40  # one line
        stop_is_clear(fresh)
        look_at(fresh, f"{width}")
    assert violations(fresh) == []


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1500, 900), (1920, 1080), (1024, 768), (820, 1180)])
def test_the_bar_of_areas_and_what_is_under_way_are_never_cut(
    fresh: Page, width: int, height: int, look_at: Look
) -> None:
    fresh.set_viewport_size({"width": width, "height": height})
    fresh.get_by_label("Theme").select_option("sunlight")
    for layout in fresh.locator("#layout option").all_text_contents():
        fresh.locator("#layout").select_option(layout)
        seen = fresh.evaluate(CUT, "foot moves planned: 12, the nearest comes within 0.42 m, 35 %")
        assert seen["parts"] == 20
        assert seen["cut"] == [], layout
        if layout in ("plan a step", "plots"):
            look_at(fresh, layout.replace(" ", "-"))


def test_what_came_of_a_run_leaves_the_scene_its_room_where_there_is_no_side(fresh: Page) -> None:
    fresh.locator("#layout").select_option("plots")
    seen = fresh.evaluate(f"""() => {{
      document.getElementById("result").hidden = false;
      document.getElementById("outcome-text").textContent = "The chassis sank by more than was predicted. ".repeat(90);
      return ({COVERED})();
    }}""")
    assert seen["outside"] == seen["over"] == [], seen
    assert seen["height"] >= 270


def test_on_a_tablet(chromiums: Browsers, quiet: Running, look_at: Look) -> None:
    context = chromiums(False).new_context(viewport={"width": 1024, "height": 768}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(f"{quiet.url}/?scene=off")
    expect(page.locator("#timeline-text")).to_contain_text("Latest")
    page.locator("#area-goal").click()
    page.locator("#panel-goal .float").click()
    for width, height in ((1024, 768), (768, 1024)):
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate("() => document.documentElement.scrollWidth - innerWidth") == 0
        for part in ("#next-act", "#scrub", "#stop"):
            expect(page.locator(part)).to_be_in_viewport(ratio=1)
        seen = page.evaluate(COVERED)
        assert seen["outside"] == seen["over"] == [], seen
        until(lambda: box(page, "#panel-goal")["width"] <= box(page, ".scene")["width"], "the new room")
        keeps_its_place(page, "goal")
        look_at(page, f"{width}")
    context.close()


def test_what_was_kept_before_there_were_cards_stays(fresh: Page) -> None:
    fresh.evaluate(
        "text => { localStorage['footfall.layout'] = text; }", '{"chosen":"execute","shown":{"execute":["legs"]}}'
    )
    fresh.reload()
    expect(fresh.locator("#layout")).to_have_value("execute")
    assert fresh.evaluate(IN_SIGHT) == ["legs"]
    broken = {"chosen": "walk", "shown": {"walk": 5}, "closed": "all", "placed": {"walk": {"goal": {"at": "scene"}}}}
    fresh.evaluate("text => { localStorage['footfall.layout'] = text; }", json.dumps(broken))
    fresh.reload()
    expect(fresh.locator("#panel-goal")).to_be_visible()
    assert fresh.evaluate(IN_SIGHT) == WALK


CARDS = """async ([summary, frame]) => {
  const { known } = (await import("/js/page.js")).modules["store.js"];
  const { stateOf } = (await import("/js/page.js")).modules["layout/states.js"];
  const before = { ...known };
  Object.assign(known, { summary: { ...known.summary, ...summary } });
  const heard = { wheel_forces: Array(6).fill([0, 0, 1000]), age_s: frame, heardAt: performance.now() };
  if (frame !== null) known.frame = heard;
  const told = ["commands", "plan", "legs", "telemetry"].map(stateOf);
  Object.assign(known, before);
  return told;
}"""
"""What closed cards say where the server says this of the session, of telemetry that is so old [s]."""


def test_a_closed_card_calls_nothing_good_that_is_over_or_of_something_else(fresh: Page) -> None:
    expect(fresh.locator("#panel-commands > .state")).to_contain_text("commands")
    commands, plan, *_ = fresh.evaluate(CARDS, [{}, None])
    assert commands.startswith("✓ ")
    assert plan == "found, every check holds"
    assert fresh.evaluate(CARDS, [{"commands_carried_out": True}, None])[0].startswith("carried out, ")
    assert fresh.evaluate(CARDS, [{"commands_of_another_plan": True}, None])[0] == f"▲ of another plan: {commands}"
    aside = {"footfall": {"leg": 2, "x": 9.0, "y": 9.0}}
    assert fresh.evaluate(CARDS, [aside, None])[1] == f"▲ to another footfall: {plan}"
    assert fresh.evaluate(CARDS, [{}, 0.5])[2] == "all stand"
    assert fresh.evaluate(CARDS, [{}, 30.0])[2:] == ["▲ 30 s ago: all stand", "▲ STALE, 30 s old"]


def test_each_tab_keeps_its_own_layout_over_a_reload(fresh: Page) -> None:
    fresh.locator("#layout").select_option("execute")
    other = fresh.context.new_page()
    other.goto(fresh.url)
    expect(other.locator("#layout")).to_have_value("execute")
    other.locator("#layout").select_option("plots")
    expect(other.locator("#panel-plots")).to_be_visible()
    fresh.reload()
    expect(fresh.locator("#panel-commands")).to_be_visible()
    expect(fresh.locator("#layout")).to_have_value("execute")
    other.reload()
    expect(other.locator("#panel-plots")).to_be_visible()
    expect(other.locator("#layout")).to_have_value("plots")


# -- cards -----------------------------------------------------------------------------------------


def test_the_card_where_the_job_is_opens_and_one_that_is_closed_says_its_state(fresh: Page, quiet: Running) -> None:
    ground, goal = fresh.locator("#panel-ground"), fresh.locator("#panel-goal")
    expect(ground.locator(".fold")).to_have_attribute("aria-expanded", "true")
    expect(fresh.locator("#take-images")).to_be_visible()
    expect(goal.locator(".state")).to_have_text("none")
    ground.locator(".fold").click()
    expect(fresh.locator("#take-images")).to_be_hidden()
    with quiet.client() as client:
        share = client.get(SESSION).json()["terrain"]["known"]
    expect(ground.locator(".state")).to_have_text(re.compile(rf"^{100 * share:.0f} % known, \d+ h old$"))
    fresh.evaluate(DRAWN)  # the same thing is next: it stays as the operator has it
    expect(fresh.locator("#take-images")).to_be_hidden()
    ground.locator("h2").click()
    expect(fresh.locator("#take-images")).to_be_visible()

    # a goal comes: what is next stands there
    with quiet.client() as client:
        client.put(f"{SESSION}/view", json={"goal": [900.0, 0.0]}).raise_for_status()
    expect(fresh.locator("#next-act")).to_have_text("Plan walk")
    expect(fresh.locator("#plan-walk")).to_be_visible()
    expect(fresh.locator("#take-images")).to_be_visible()  # it was opened by hand
    goal.locator(".fold").click()
    expect(goal.locator(".state")).to_have_text("to (900.00, 0.00) m")
    expect(fresh.locator("#plan-walk")).to_be_hidden()
    fresh.locator("#next-act").click()
    expect(fresh.locator("#next-act")).to_have_text("Choose another goal")
    expect(fresh.locator("#walk-to")).to_be_visible()
    expect(fresh.locator("#panel-walk .state")).to_have_text("no walk found")
    expect(fresh.locator("#job-said")).to_have_text(re.compile("^No walk: "))
    assert violations(fresh) == []


def test_a_card_that_the_job_opened_closes_when_the_job_has_gone_on(fresh: Page, quiet: Running) -> None:
    expect(fresh.locator("#take-images")).to_be_visible()
    fresh.locator("#panel-ground h2").hover()
    with quiet.client() as client:
        client.put(f"{SESSION}/view", json={"goal": [1.0, 0.0]}).raise_for_status()
    expect(fresh.locator("#plan-walk")).to_be_visible()
    expect(fresh.locator("#take-images")).to_be_visible()  # the hand is there
    fresh.locator("#stop").hover()
    expect(fresh.locator("#take-images")).to_be_hidden()
    fresh.locator("#layout").select_option("plan a step")
    expect(fresh.locator("#take-images")).to_be_visible()
    fresh.locator("#panel-ground .fold").click()
    fresh.evaluate(DRAWN)
    expect(fresh.locator("#take-images")).to_be_hidden()


# -- elsewhere -------------------------------------------------------------------------------------


def test_a_floating_area_is_moved_by_keys_and_put_back(fresh: Page) -> None:
    fresh.locator("#area-goal").click()
    fresh.locator("#panel-goal .float").click()
    keeps_its_place(fresh, "goal")
    assert fresh.evaluate(IN_SIGHT) == [one for one in WALK if one != "goal"]
    begin = box(fresh, "#panel-goal")
    grip = fresh.get_by_role("button", name="Move Goal by the arrow keys")
    grip.press("Enter")
    for key in ("ArrowLeft", "ArrowLeft", "ArrowDown", "Shift+ArrowLeft", "Shift+ArrowDown"):
        fresh.keyboard.press(key)
    expect(fresh.locator("#panel-goal .state")).to_contain_text("Escape puts it back")
    assert violations(fresh) == []
    fresh.keyboard.press("Enter")
    moved = {"x": begin["x"] - 32, "y": begin["y"] + 16, "width": begin["width"] - 16, "height": begin["height"] + 16}
    assert box(fresh, "#panel-goal") == pytest.approx(moved)
    grip.press("Enter")
    for _ in range(60):
        fresh.keyboard.press("ArrowUp")
    keeps_its_place(fresh, "goal")
    assert box(fresh, "#panel-goal")["y"] < moved["y"]
    fresh.keyboard.press("Escape")
    assert box(fresh, "#panel-goal") == pytest.approx(moved)
    fresh.keyboard.press("ArrowUp")  # the keys are the page's again
    assert box(fresh, "#panel-goal") == pytest.approx(moved)


def test_a_floating_area_is_moved_by_mouse_and_survives_a_reload(fresh: Page, look_at: Look) -> None:
    fresh.locator("#area-walk").click()
    fresh.locator("#panel-walk .float").click()
    begin = box(fresh, "#panel-walk")
    drag(fresh, "#h-walk", (-120, 40))
    at = {**begin, "x": begin["x"] - 120, "y": begin["y"] + 40}
    assert box(fresh, "#panel-walk") == pytest.approx(at)
    drag(fresh, "#panel-walk .corner", (60, -50))
    at |= {"width": begin["width"] + 60, "height": begin["height"] - 50}
    assert box(fresh, "#panel-walk") == pytest.approx(at)
    keeps_its_place(fresh, "walk")
    look_at(fresh, "floats")
    fresh.reload()
    expect(fresh.locator("#panel-walk.afloat")).to_be_visible()
    assert box(fresh, "#panel-walk") == pytest.approx(at)

    drag(fresh, "#h-walk", (500, -400))  # at STOP
    keeps_its_place(fresh, "walk")
    corner = box(fresh, "#panel-walk")
    fresh.set_viewport_size({"width": 1024, "height": 640})
    until(lambda: box(fresh, "#panel-walk") != corner, "its new place")
    keeps_its_place(fresh, "walk")
    fresh.set_viewport_size({"width": 1280, "height": 720})
    until(lambda: box(fresh, "#panel-walk") == corner, "its old place")

    fresh.locator("#layout").select_option("review")
    expect(fresh.locator("#panel-walk")).to_be_hidden()  # each layout has its own
    fresh.locator("#area-walk").click()
    assert fresh.evaluate(IN_SIGHT) == ["legs", "telemetry", "walk", "sessions", "record"]
    fresh.keyboard.press("6")
    expect(fresh.locator("#panel-walk.afloat")).to_be_visible()
    fresh.locator("#panel-walk .float").click()
    assert fresh.evaluate(IN_SIGHT) == WALK
    expect(fresh.locator("#panel-walk .float")).to_be_focused()


def drag(page: Page, selector: str, by: tuple[float, float]) -> None:
    at = box(page, selector)
    x, y = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + by[0] / 2, y + by[1] / 2)
    page.mouse.move(x + by[0], y + by[1])
    page.mouse.up()


def test_an_area_docks_and_what_was_changed_is_undone(fresh: Page) -> None:
    fresh.locator("#panel-commands .to-dock").click()
    expect(fresh.locator("#dock > #panel-commands")).to_be_visible()
    fresh.locator("#panel-commands .fold").click()
    expect(fresh.locator("#arm")).to_be_visible()
    assert box(fresh, ".scene")["height"] >= 270
    stop_is_clear(fresh)
    assert violations(fresh) == []
    fresh.keyboard.press("F6")  # the focus is in the last of the page's order but one
    assert fresh.evaluate("() => document.activeElement.tagName") == "H2"
    fresh.reload()
    expect(fresh.locator("#dock > #panel-commands")).to_be_visible()
    find_act(fresh, "undo the latest change of the layout")
    expect(fresh.locator("#palette-list")).to_contain_text("has not been changed since the page was loaded")
    fresh.keyboard.press("Escape")
    fresh.locator("#panel-commands .to-dock").click()
    assert fresh.evaluate(IN_SIGHT) == WALK
    find_act(fresh, "undo the latest change of the layout")
    expect(fresh.locator("#dock > #panel-commands")).to_be_visible()
    find_act(fresh, "layout as delivered")
    assert fresh.evaluate(IN_SIGHT) == WALK
    expect(fresh.locator("#arm")).to_be_hidden()
    assert fresh.evaluate(KEPT)["chosen"] == "walk"


def test_a_floating_box_is_fitted_as_clipping_has_it(fresh: Page) -> None:
    rng = np.random.default_rng(5)
    names = ("left", "top", "width", "height")
    given = []
    for _ in range(200):
        room = [*rng.uniform(0, 100, 2), *rng.uniform(0, 1500, 2)]
        wanted = [*rng.uniform(-2000, 2000, 2), *rng.uniform(-100, 2000, 2)]
        given.append([dict(zip(names, values, strict=True)) for values in (wanted, room)])
    for (wanted, room), fitted in zip(given, fresh.evaluate(FITTED, given), strict=True):
        for at, size, least in (("left", "width", 260), ("top", "height", 120)):
            length = np.clip(wanted[size], min(least, room[size]), room[size])
            assert fitted[size] == pytest.approx(length)
            assert fitted[at] == pytest.approx(np.clip(wanted[at], room[at], room[at] + room[size] - length))
