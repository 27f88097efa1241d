"""Login with an organisation's provider: a real one on loopback, and what must not come through."""

import time
from contextlib import closing, contextmanager
from copy import copy
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from argon2 import PasswordHasher
from joserfc.jwk import ECKey, OctKey

from footfall.api.auth import oidc
from footfall.api.auth.oidc import SignOn
from footfall.core.errors import Conflict, InvalidInput, NotFound
from footfall.io.account_store import FILE
from footfall.io.sign_on_file import FILE as SIGN_ON_FILE
from footfall.io.sign_on_file import SignOnSettings, read_sign_on
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import Identity, Role
from footfall_ui.app import serve
from tests.support.provider import CLIENT, SECRET, provider
from tests.support.server import running_server
from tests.support.waiting import BOUND

BOSS = Identity("boss", Role.ADMIN, "command line")
PASSWORD = "a long and good one"


@pytest.fixture(scope="module")
def accounts(tmp_path_factory):
    path = tmp_path_factory.mktemp("accounts") / FILE
    with closing(Accounts(path, hasher=PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))) as made:
        made.add("ada", Role.ADMIN, PASSWORD, BOSS)
        yield made


@pytest.fixture(scope="module")
def both(tmp_path_factory, accounts):
    """(the provider, a server that believes it)"""
    with provider() as issuing:
        roles = {"viewer": ("staff",), "commander": ("drivers", "leads")}
        sign_on = SignOn(SignOnSettings(issuing.issuer, CLIENT, roles, SECRET))
        with running_server(tmp_path_factory.mktemp("sessions"), accounts=accounts, sign_on=sign_on) as running:
            yield issuing, running


@pytest.fixture
def issuing(both):
    """The provider, which behaves again after each test."""
    made = both[0]
    before = {name: copy(value) for name, value in vars(made).items() if not name.startswith("_")}
    yield made
    vars(made).update(before)


@pytest.fixture
def server(both):
    return both[1]


@contextmanager
def browser(server):
    with httpx.Client(base_url=server.api, timeout=BOUND, trust_env=False, verify=False) as client:
        yield client


def gone_to(client):
    """Where the provider sends the browser back to."""
    left = client.get("login/oidc")
    assert left.status_code == 303
    return httpx.get(left.headers["location"], trust_env=False, verify=False).headers["location"]


def reason(answer):
    """What the login page is to tell of."""
    assert answer.status_code == 303
    assert not [one for one in answer.headers.get_list("set-cookie") if one.startswith("footfall=")]
    return answer.headers["location"].removeprefix("/login.html?sign-on=")


def test_who_logs_in_there_is_logged_in_here_with_the_role_that_the_claim_gives(issuing, server, accounts):
    with browser(server) as client:
        assert client.get("login/ways").json() == {"provider": issuing.issuer}
        assert client.get("me").status_code == 401
        answer = client.get(gone_to(client))
        assert answer.status_code == 200
        assert 'content="0;url=/"' in answer.text
        (cookie,) = [one for one in answer.headers.get_list("set-cookie") if one.startswith("footfall=")]
        assert "HttpOnly" in cookie
        assert "SameSite=strict" in cookie
        me = client.get("me").json()
        assert (me["name"], me["role"]) == ("ida", "commander")
        client.post("logout", headers={"Origin": server.url, "Sec-Fetch-Site": "same-origin"})
        assert client.get("me").status_code == 401
    acts = [(one.who, one.act) for one in accounts.audit()]
    assert acts[-3:] == [("ida", "role given"), ("ida", "login"), ("ida", "logout")]


def test_the_claim_counts_at_each_login_and_the_highest_role_wins(issuing, server):
    for groups, role in ((["staff"], "viewer"), (["staff", "leads", "others"], "commander"), ("staff", "viewer")):
        issuing.person["groups"] = groups
        with browser(server) as client:
            client.get(gone_to(client))
            assert client.get("me").json()["role"] == role
    for groups in (["others"], [], None, 7, {"drivers": 1}):
        issuing.person["groups"] = groups
        with browser(server) as client:
            assert reason(client.get(gone_to(client))) == "no-role"


LIES = {
    "another nonce": {"nonce": "another"},
    "no nonce": {"nonce": None},
    "for another program": {"aud": "another program"},
    "for nobody": {"aud": None},
    "of another provider": {"iss": "https://elsewhere.example"},
    "that has run out": {"exp": -3600},
    "that never runs out": {"exp": None},
    "made in the future": {"iat": 3600},
    "about nobody": {"sub": None},
    "given to another program": {"azp": "another program"},
}


@pytest.mark.parametrize("claims", LIES.values(), ids=LIES)
def test_a_token_that_is_not_for_this_login_is_refused(issuing, server, claims):
    now = int(time.time())
    issuing.claims = {name: now + told if isinstance(told, int) else told for name, told in claims.items()}
    with browser(server) as client:
        assert reason(client.get(gone_to(client))) == "unproven"
        assert client.get("me").status_code == 401


def test_a_token_that_the_provider_did_not_sign_is_refused(issuing, server):
    stranger = ECKey.generate_key("P-256", {"kid": "one"})
    with browser(server) as client:
        issuing.key = stranger
        assert reason(client.get(gone_to(client))) == "unproven"
        # with a secret that anybody can make up
        issuing.header = {"alg": "HS256", "kid": "one"}
        issuing.key = OctKey.generate_key(256)
        assert reason(client.get(gone_to(client))) == "unproven"


def test_a_new_key_of_the_provider_is_taken_at_once(issuing, server):
    issuing.key = ECKey.generate_key("P-256", {"kid": "two"})
    issuing.keys = [*issuing.keys, issuing.key]
    issuing.header = {"alg": "ES256", "kid": "two"}
    with browser(server) as client:
        client.get(gone_to(client))
        assert client.get("me").json()["name"] == "ida"


def test_a_login_ends_in_the_browser_that_began_it_and_once(issuing, server):
    with browser(server) as mine, browser(server) as theirs:
        back = gone_to(theirs)
        assert reason(mine.get(back)) == "expired"  # the link of somebody else
        gone_to(mine)
        assert reason(mine.get(back)) == "expired"
        assert theirs.get(gone_to(theirs)).status_code == 200
    with browser(server) as client:
        back = gone_to(client)
        state = parse_qs(urlsplit(back).query)["state"][0]
        assert client.get(back).status_code == 200
        client.cookies.set("footfall-sign-on", state, domain="127.0.0.1")
        assert reason(client.get(back)) == "expired"
        assert reason(client.get("login/oidc/back")) == "expired"


def test_a_login_that_took_too_long_or_has_a_wrong_code_is_refused(issuing, server, monkeypatch):
    with browser(server) as client:
        back = gone_to(client)
        with monkeypatch.context() as patched:
            patched.setattr(oidc, "LASTS", -1.0)
            assert reason(client.get(back)) == "expired"
        back = gone_to(client)
        code = parse_qs(urlsplit(back).query)["code"][0]
        assert reason(client.get(back.replace(code, "guessed"))) == "refused"
        issuing.refuses = True
        assert reason(client.get(gone_to(client))) == "refused"


def test_a_name_that_is_taken_or_can_not_be_one_is_refused(issuing, server, accounts):
    for about in (
        {"preferred_username": "ada"},  # a local account
        {"sub": "another person"},
        {"preferred_username": "Ida Smith"},
        {"preferred_username": "local"},
    ):
        issuing.claims = about
        with browser(server) as client:
            assert reason(client.get(gone_to(client))) == "taken"
    with browser(server) as client:  # and it has no password that fits
        refused = client.post("login", json={"name": "ida", "password": "known " + "0" * 64})
        assert refused.status_code == 401
    accounts.set_role("ida", Role.ADMIN, BOSS)
    with pytest.raises(Conflict, match="last admin"):
        accounts.remove("ada", BOSS)


def test_a_provider_that_can_not_be_used_is_told(issuing, server):
    with browser(server) as client:
        issuing.claimed_issuer = "https://elsewhere.example"
        assert reason(client.get("login/oidc")) == "unproven"
    gone = SignOn(SignOnSettings("http://127.0.0.1:9", CLIENT, {}))
    with pytest.raises(oidc.SignOnFailed, match=r"127\.0\.0\.1:9") as caught:
        gone.begin("http://127.0.0.1/back")
    assert caught.value.kind == "unreachable"


def test_it_is_off_unless_it_is_set_up(tmp_path, accounts):
    with running_server(tmp_path, accounts=accounts) as running, browser(running) as client:
        assert client.get("login/ways").json() == {"provider": None}
        assert client.get("login/oidc").status_code == 409
        assert client.get("login/oidc/back").status_code == 409


RIGHT = (
    'issuer = "https://login.example"\nclient_id = "footfall"\n[roles]\ncommander = "drivers"\nviewer = ["a", "b"]\n'
)


def test_the_file_says_what_is_wrong_with_it(tmp_path):
    assert read_sign_on(tmp_path) is None
    path = tmp_path / SIGN_ON_FILE
    path.write_text(RIGHT)
    path.chmod(0o644)
    found = read_sign_on(tmp_path)
    assert found is not None
    assert found.roles == {"commander": ("drivers",), "viewer": ("a", "b")}
    for wrong, why in (
        ("= =", "oidc.toml"),
        (RIGHT.replace("https", "http"), "https address"),
        (RIGHT.replace("client_id", "client"), "not client"),
        (RIGHT.replace('client_id = "footfall"\n', ""), "client_id"),
        (RIGHT.replace("commander", "pilot"), "roles"),
        (RIGHT.replace('"drivers"', "7"), "list of texts"),
        ('issuer = "https://x"\nclient_id = "y"\n', "roles"),
    ):
        path.write_text(wrong)
        with pytest.raises(InvalidInput, match=why):
            read_sign_on(tmp_path)
    path.write_text(f'client_secret = "s"\n{RIGHT}')
    with pytest.raises(Conflict, match="chmod 600"):
        read_sign_on(tmp_path)
    path.chmod(0o600)
    with pytest.raises(NotFound, match="has none of its own"):
        serve(port=0, folder=tmp_path, sample=None, sim=False)
