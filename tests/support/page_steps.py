"""What the tests of the operator's page do alike: press, wait for jobs, plan, command for sag."""

import json
import re
from collections.abc import Callable

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from tests.support.server import Running
from tests.support.waiting import until

SESSION = "/sessions/current"
RIGID = pytest.mark.parametrize("sample", ["edited-export"])
"""For a sample whose commands are a rigid rover's: rows move one leg, and a rover without springs takes them."""
STEPS = "plan a step"
"""The layout for single steps; the page is delivered with another."""
LAID_OUT = """layout => {
  try {
    localStorage["footfall.layout"] ??= JSON.stringify({ chosen: layout, shown: {} });
  } catch { /* of a document that keeps nothing */ }
}"""


def lay_out(where: Page | BrowserContext, layout: str = STEPS) -> None:
    """What is opened there from now on begins in that layout, as for an operator who chose it before."""
    where.add_init_script(f"({LAID_OUT})({json.dumps(layout)})")


def held(served: Running, path: str = SESSION):
    """What the API holds there."""
    with served.client() as client:
        return client.get(path).json()


def figure(value: float, digits: int) -> str:
    """A number as the page writes it to be read: with a true minus sign, without one where it rounds to nothing."""
    return f"{value:z.{digits}f}".replace("-", "−")


def let_pass(page: Page, seconds: float) -> None:
    """So much time passes for the page at once: what it looks at every now and then it looks at next."""
    later = "ms => { const now = performance.now.bind(performance); performance.now = () => now() + ms; }"
    page.evaluate(later, 1000.0 * seconds)


def as_shown(text: str) -> str:
    """What the server says as the page shows it: numbers in it have true minus signs."""
    return re.sub(r"(?<![\w./=-])-(?=\d)", "−", text)


def press(page: Page, name: str) -> None:
    """Click the button of that name, which may say after a colon of what."""
    page.get_by_role("button", name=re.compile(rf"^{re.escape(name)}(:|$)")).click()


def keep_pressed(page: Page, selector: str) -> None:
    """Hold a button until it has acted."""
    button = page.locator(selector)
    expect(button).to_be_enabled()
    button.hover()
    page.mouse.down()
    expect(button).not_to_have_class(re.compile(r"\bheld\b"))
    page.mouse.up()


def made(served: Running, kind: str, act: Callable[[], None]) -> None:
    """Do what orders a job of this kind, and wait for its end."""
    before = {job["id"] for job in held(served)["jobs"]}
    act()

    def done() -> bool:
        jobs = [job for job in held(served)["jobs"] if job["id"] not in before and job["kind"] == kind]
        return bool(jobs) and jobs[-1]["state"] == "done"

    until(done, f"the {kind}")


def planned(page: Page, served: Running, act: Callable[[], None]) -> dict:
    """Plan a step; the new result, which the page knows."""
    made(served, "plan", act)
    answer = held(served, f"{SESSION}/plans/current")
    assert answer["status"] == "found", answer["reason"]
    # wait_for_function would take the promise itself for true
    knows = "async () => (await import('/js/page.js')).modules['store.js'].known.summary?.plan?.digest"
    until(lambda: page.evaluate(knows) == answer["digest"], "the page's hearing of the plan")
    return answer


def commanded(page: Page, served: Running, act: Callable[[], None]) -> dict:
    """Order an execution; the new one, which the page shows."""
    made(served, "execution", act)
    answer = held(served, f"{SESSION}/executions/current")
    words = "Can be commanded" if answer["status"] == "found" else answer["reason"]
    expect(page.locator("#execution-answer")).to_contain_text(words)
    return answer


def sequenced(served: Running, act: Callable[[], None]) -> dict:
    """Make commands; the new sequence."""
    before = held(served)["sequence"]
    act()
    until(lambda: held(served)["sequence"] != before, "the commands")
    return held(served, f"/sequences/{held(served)['sequence']}")
