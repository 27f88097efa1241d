"""Logging in on the page, what a role sees of it, and that no code but the server's own is wanted by page and scene."""

from contextlib import closing

import pytest
from argon2 import PasswordHasher
from playwright.sync_api import expect

from footfall.io.account_store import FILE
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import Identity, Role
from tests.support.page_steps import lay_out
from tests.support.server import Running, running_server

BOSS = Identity("boss", Role.ADMIN, "command line")
PASSWORD = "a long and good one"
TELL = (
    "window.addEventListener('securitypolicyviolation', "
    "e => console.error(`policy: ${e.effectiveDirective} ${e.blockedURI} in ${e.documentURI}`))"
)


@pytest.fixture
def guarded(tmp_path):
    """A server with accounts, and without scene."""
    with closing(Accounts(tmp_path / FILE, hasher=PasswordHasher(1, 8, 1))) as accounts:
        accounts.add("ada", Role.ADMIN, PASSWORD, BOSS)
        accounts.add("vic", Role.VIEWER, PASSWORD, BOSS)
        with running_server(tmp_path, accounts=accounts, prepare=lambda s: s.open_sample("rock-step")) as running:
            yield running


@pytest.fixture
def fresh(chromium):
    """A page of a browser that was never here, and what its console says of policies."""
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    made = context.new_page()
    made.add_init_script(TELL)
    lay_out(made)
    yield made
    context.close()


def violations(page) -> list[str]:
    """Filled as the page goes on."""
    found: list[str] = []
    page.on("console", lambda said: found.append(said.text) if "olicy" in said.text else None)
    return found


def test_a_viewer_logs_in_looks_stops_and_logs_out(fresh, guarded: Running):
    faults = violations(fresh)
    fresh.goto(guarded.url)
    expect(fresh).to_have_url(f"{guarded.url}/login.html")
    fresh.get_by_label("Name").fill("vic")
    fresh.get_by_label("Password").fill("a wrong password")
    fresh.get_by_role("button", name="Log in").click()
    expect(fresh.get_by_role("alert")).to_have_text("Name or password is wrong.")
    fresh.get_by_label("Password").fill(PASSWORD)
    fresh.keyboard.press("Enter")
    expect(fresh.locator("#status-user")).to_have_text("vic, viewer")
    assert not fresh.evaluate("document.cookie")  # no script can read it

    for button, role in (("#plan", "planner"), ("#arm", "commander"), ("#send", "commander")):
        expect(fresh.locator(button)).to_be_disabled()
        expect(fresh.locator(button)).to_have_attribute("title", f"This needs the role {role}; you are viewer.")
    fresh.locator("#stop").click()
    expect(fresh.locator("#stop-state")).to_contain_text("Stop in force")

    fresh.get_by_role("button", name="Log out").click()
    expect(fresh).to_have_url(f"{guarded.url}/login.html")
    fresh.goto(guarded.url)
    expect(fresh).to_have_url(f"{guarded.url}/login.html")
    assert not faults


def test_who_logs_out_is_not_told_that_the_login_ended(fresh, guarded: Running):
    """Also where something that was asked meanwhile is answered before the logout is: it comes too late."""
    fresh.goto(guarded.url)
    fresh.get_by_label("Name").fill("vic")
    fresh.get_by_label("Password").fill(PASSWORD)
    fresh.keyboard.press("Enter")
    expect(fresh.locator("#status-user")).to_have_text("vic, viewer")
    fresh.route("**/api/v1/logout", lambda route: route.fetch())
    fresh.get_by_role("button", name="Log out").click()
    # the logout's own answer never comes: what the page asks meanwhile is refused, and leads there
    expect(fresh).to_have_url(f"{guarded.url}/login.html")
    expect(fresh.locator("#ended, [role=status]")).not_to_contain_text("has ended")


@pytest.mark.scene
def test_page_and_scene_keep_to_their_policies_and_say_that_there_are_no_accounts(fresh, tmp_path):
    faults = violations(fresh)
    with running_server(tmp_path, scene=True, prepare=lambda s: s.open_sample("rock-step")) as running:
        policies: dict[str, str] = {}

        def note(answer):
            if answer.url.startswith("http"):
                policies[answer.url] = answer.headers.get("content-security-policy", "")

        fresh.on("response", note)
        fresh.goto(f"{running.url}/?fixedDpr=0.5")
        user = fresh.locator("#status-user")
        expect(user).to_have_text("No login: anyone can command")
        expect(user).to_have_attribute("title", "no login: anyone on this computer can command")
        assert user.evaluate("one => one.scrollHeight <= one.clientHeight"), "it is cut"
        fresh.frame_locator("#scene").locator("canvas").first.wait_for()
        fresh.wait_for_timeout(2000)  # workers and WebAssembly come after the canvas
        assert len(policies) > 20
        for url, policy in policies.items():
            assert policy.startswith("default-src 'none'"), url
            assert "script-src" not in policy or "'unsafe-inline'" not in policy.split("script-src")[1].split(";")[0], (
                url
            )
    assert not faults
