"""The queue on the page: planned on step by step, seen as a list, shortened, and sent as one command list."""

from playwright.sync_api import Page, expect

from tests.support.page_steps import SESSION, held, press, sequenced
from tests.support.server import Running
from tests.support.waiting import until

LEG = 2
PLACES = (-0.45, 1.8), (-0.9, 1.62)
"""Where its wheel goes first, and from there [m]."""


def plan_to(page: Page, served: Running, place: tuple[float, float]) -> str:
    """A step from the state that is planned from; the page knows it then."""
    live = served.sessions.current
    assert live is not None
    digest = live.plans.step(LEG, place).finish()
    assert live.state.plan_status == "found", live.state.plan_reason
    knows = "async () => (await import('/js/page.js')).modules['store.js'].known.summary?.plan?.digest"
    until(lambda: page.evaluate(knows) == digest, "the page's hearing of the plan")
    return digest


def queue_both(page: Page, served: Running) -> list[str]:
    """Two steps, planned one after the other and queued."""
    plans = []
    for number, place in enumerate(PLACES, 1):
        plans.append(plan_to(page, served, place))
        press(page, "Queue it, and go on")
        expect(page.locator("#queue tbody tr")).to_have_count(number)
        expect(page.locator("#queue-state")).to_contain_text(f"is planned from where entry {number} ends")
    return plans


def test_two_steps_are_listed_commanded_and_carried_out(page: Page, served: Running) -> None:
    plans = queue_both(page, served)
    told = held(served)["queue"]["entries"]
    assert [one["plan"] for one in told] == plans
    cells = page.locator("#queue tbody tr").nth(1).locator("td")
    assert [cells.nth(i).inner_text() for i in range(3)] == ["2", "step", "2"]
    assert cells.nth(3).inner_text() == f"{told[1]['duration']:.1f}"
    assert cells.nth(4).inner_text() == f"{told[1]['margin']:.3f}"
    # it is the session's, not the page's
    page.reload()
    expect(page.locator("#queue tbody tr")).to_have_count(2)

    page.locator("#as-commanded").check()
    sequence = sequenced(served, lambda: page.locator("#queue-make").click())
    assert sequence["valid"], sequence["rules"]
    assert [one["text"] for one in sequence["foot_moves"]] == ["entry 1 of 2: leg 2", "entry 2 of 2: leg 2"]
    expect(page.locator("#commands tr.group")).to_have_count(2)
    press(page, "Arm")
    expect(page.locator("#arm-state")).to_contain_text("armed for")
    press(page, "Send to rover")
    until(lambda: held(served)["queue"]["carried_out"], "the arrival")
    until(
        lambda: held(served, f"{SESSION}/telemetry")["posture"] == sequence["predicted"][-1], "telemetry of the arrival"
    )
    expect(page.locator("#queue-state")).to_contain_text("was carried out")


def test_entries_are_taken_from_the_end_and_undone(page: Page, served: Running) -> None:
    queue_both(page, served)
    page.get_by_label("Take entry 2 from the queue").click()
    expect(page.locator("#queue tbody tr")).to_have_count(1)
    expect(page.locator("#queue-state")).to_contain_text("is planned from where entry 1 ends")
    page.locator("#undo").click()
    expect(page.locator("#queue tbody tr")).to_have_count(2)
    # another was planned from meanwhile: it is said, and can be set right
    expect(page.locator("#queue-state")).to_contain_text("not planned from where entry 2 ends")
    page.locator("#queue-on").click()
    expect(page.locator("#queue-state")).to_contain_text("is planned from where entry 2 ends")
    press(page, "Empty")
    expect(page.locator("#queue-box")).to_be_hidden()
    assert held(served)["what_if"] is None


def test_what_does_not_follow_is_refused_on_the_page(page: Page, served: Running) -> None:
    queue_both(page, served)
    press(page, "Queue it, and go on")
    expect(page.locator("#toast")).to_contain_text("does not begin where entry 2 of the queue ends")
    expect(page.locator("#queue tbody tr")).to_have_count(2)
