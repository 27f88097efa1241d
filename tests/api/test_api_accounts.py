"""Who may do what on a server with accounts: every route, every role, every way in; and nobody without one."""

import json
import sqlite3
import threading
from contextlib import closing, contextmanager

import httpx
import msgspec
import pytest
import viser
from argon2 import PasswordHasher
from fastapi.routing import APIRoute, APIWebSocketRoute, _IncludedRouter
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from footfall.api.access import BASE
from footfall.api.auth.roles import Needs, allows, declared, needed
from footfall.api.door.front import Front
from footfall.api.door.guard import refusal
from footfall.core.errors import InvalidInput
from footfall.io.account_store import FILE
from footfall.planning.body.stand import stand
from footfall.session.access.accounts import Accounts
from footfall.session.access.identity import Identity, Role
from footfall.terrain.generate import plane
from footfall_ui.app import create_app
from footfall_ui.listening import require_safe
from tests.support.server import running_server
from tests.support.waiting import BOUND, a_while, until

BOSS = Identity("boss", Role.ADMIN, "command line")
PASSWORD = "a long and good one"
NAMES = {"vic": Role.VIEWER, "pia": Role.PLANNER, "con": Role.COMMANDER, "ada": Role.ADMIN}


@pytest.fixture(scope="module")
def accounts(tmp_path_factory):
    path = tmp_path_factory.mktemp("accounts") / FILE
    with closing(Accounts(path, hasher=PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))) as made:
        for name, role in reversed(NAMES.items()):
            made.add(name, role, PASSWORD, BOSS)
        yield made


@pytest.fixture(scope="module")
def server(tmp_path_factory, accounts):
    folder = tmp_path_factory.mktemp("sessions")
    with running_server(folder, scene=True, accounts=accounts, prepare=lambda s: s.create("guarded")) as running:
        yield running


@pytest.fixture(scope="module")
def tokens(accounts):
    """Role → token of an account with it."""
    return {role: accounts.add_token(f"of-{name}", name, BOSS) for name, role in NAMES.items()}


@pytest.fixture(scope="module")
def gateway(accounts):
    return accounts.add_token("gateway", None, BOSS)


def bearer(token):
    return {"Authorization": f"Bearer {token}"}


@contextmanager
def page(server):
    """A browser's page: keeps cookies and says where it comes from."""
    with httpx.Client(
        base_url=server.url, headers={"Origin": server.url}, timeout=BOUND, trust_env=False, verify=False
    ) as made:
        yield made


def log_in(made, name, password=PASSWORD):
    return made.post(f"{BASE}/login", json={"name": name, "password": password})


def line(server, path, headers, **options):
    url = "ws" + server.url.removeprefix("http") + path
    return connect(url, additional_headers=headers, proxy=None, max_size=None, **options)


@pytest.fixture(scope="module")
def routes(server):
    """(method, path below the root of the interface, whole path) of whatever answers, ``WS`` for WebSockets."""
    found = set()
    for route in create_app(server.sessions, scene=False).routes:
        nested = isinstance(route, _IncludedRouter)
        prefix = route.include_context.prefix if nested else ""
        for one in route.original_router.routes if nested else [route]:
            methods = ["WS"] if isinstance(one, APIWebSocketRoute) else getattr(one, "methods", None) or []
            # Starlette's own routes are the document of the interface and the page's files
            if isinstance(one, APIRoute | APIWebSocketRoute):
                found |= {(method, one.path, prefix + one.path) for method in methods}
    assert len(found) > 60
    return sorted(found)


def test_every_route_says_what_it_needs(routes):
    assert not [f"{method} {path}" for method, path, _ in routes if needed(method, path) is None]


def test_the_table_names_no_route_that_is_not_there(routes):
    assert not declared() - {f"{method} {path}" for method, path, _ in routes}


def test_what_a_role_may_every_higher_role_may(routes):
    for method, path, _ in routes:
        may = [allows(needed(method, path) or Role.ADMIN, Identity("x", role), None) for role in Role]
        assert may == sorted(may), (method, path)


def test_every_route_holds_to_it(server, routes, tokens, gateway):
    """Asked for real, about things that are not there: without a key 401, with too little of a role 403."""
    seen = set()
    with httpx.Client(base_url=server.url, timeout=BOUND, trust_env=False, verify=False) as client:
        for method, path, whole in routes:
            needs = needed(method, path)
            if method == "WS" or needs is Needs.NOTHING:
                continue
            place = whole.replace("{", "").replace("}", "")
            assert client.request(method, place).status_code == 401, place
            refused = [role for role in Role if not allows(needs or Role.ADMIN, Identity("x", role), None)]
            shown = [(tokens[role], False) for role in refused]
            if needs is not Needs.ROVER_TOKEN:
                shown.append((gateway, False))
            if method == "GET" and place != "/scene":
                shown += [(tokens[role], True) for role in Role if role not in refused]
            for token, allowed in shown:
                answer = client.request(method, place, headers=bearer(token))
                assert (answer.status_code != 403) == allowed, (method, place, answer.text)
                seen.add(allowed)
    assert seen == {True, False}


def test_a_refusal_says_which_role_would_do(server, tokens):
    answer = httpx.post(server.api + "/stop/clear", headers=bearer(tokens[Role.PLANNER]), trust_env=False, verify=False)
    assert answer.status_code == 403
    assert answer.json()["type"] == "/problems/forbidden"
    assert "needs the role commander; pia is planner" in answer.json()["detail"]


def test_a_page_logs_in_acts_and_logs_out(server):
    with page(server) as made:
        assert made.get("/").headers["location"] == "/login.html"
        assert made.get("/login.html").status_code == 200
        refused = log_in(made, "con", "a wrong password")
        assert (refused.status_code, refused.json()["detail"]) == (401, "name or password is wrong")
        entered = log_in(made, "con")
        assert entered.json()["role"] == "commander"
        cookie = entered.headers["set-cookie"]
        assert "HttpOnly" in cookie
        assert "samesite=strict" in cookie.lower()
        assert PASSWORD not in entered.text
        first = made.cookies["footfall"]
        assert made.get("/").status_code == 200
        assert made.get(f"{BASE}/me").json() == entered.json()
        assert made.post(f"{BASE}/stop").status_code == 200
        log_in(made, "con")  # again: another secret, and the first is good for nothing
        second = made.cookies["footfall"]
        assert second != first
        for secret in (first, second):
            answer = httpx.get(
                f"{server.api}/me", headers={"Cookie": f"footfall={secret}"}, trust_env=False, verify=False
            )
            assert answer.status_code == (401 if secret == first else 200)
        assert made.post(f"{BASE}/logout").status_code == 204
        assert "footfall" not in made.cookies
    assert (
        httpx.get(
            f"{server.api}/me", headers={"Cookie": f"footfall={second}"}, trust_env=False, verify=False
        ).status_code
        == 401
    )


def test_the_cookie_alone_does_nothing_for_other_pages(server):
    with page(server) as made:
        log_in(made, "con")
        cookie = {"Cookie": f"footfall={made.cookies['footfall']}"}
    for extra in ({}, {"Origin": "https://example.org"}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "null"}):
        answer = httpx.post(server.api + "/stop", headers={**cookie, **extra}, trust_env=False, verify=False)
        assert (answer.status_code, answer.json()["type"]) == (403, "/problems/foreign-origin"), extra
        for url in server.websockets:
            with pytest.raises(InvalidStatus):
                line(server, url.removeprefix("ws" + server.url.removeprefix("http")), {**cookie, **extra})
    same = {**cookie, "Sec-Fetch-Site": "same-origin"}
    assert httpx.post(server.api + "/stop", headers=same, trust_env=False, verify=False).status_code == 200


def test_what_others_passed_on_is_refused_unless_a_proxy_was_announced(server):
    for name in (
        *("X-Forwarded-For", "Forwarded", "X-Forwarded-Host", "X-Forwarded-Proto", "X-Forwarded-Prefix", "X-Real-IP"),
        *("Via", "CF-Connecting-IP", "True-Client-IP", "X-Client-IP", "Fly-Client-IP", "X-Original-Forwarded-For"),
    ):
        answer = httpx.get(server.api + "/info", headers={name: "for=10.0.0.1"}, trust_env=False, verify=False)
        assert answer.json()["type"] == "/problems/forwarded"
        assert name.lower() in answer.json()["detail"]


@pytest.mark.parametrize("headers", [{}, bearer("footfall_guessed"), {"Cookie": "footfall=guessed"}])
def test_no_websocket_opens_without_a_key(server, headers):
    origin = Origin(server.url) if "Cookie" in headers else None
    assert len(server.websockets) >= 5
    for url in server.websockets:
        path = url.removeprefix("ws" + server.url.removeprefix("http"))
        with pytest.raises(InvalidStatus) as caught:
            line(server, path, headers, origin=origin, subprotocols=[Subprotocol("footfall-rover-2")])
        assert caught.value.response.status_code == 403, url


def test_a_rovers_token_opens_the_rover_link_alone(server, gateway, tokens):
    with line(server, BASE + "/rover", bearer(gateway), subprotocols=[Subprotocol("footfall-rover-2")]) as link:
        link.send("this is no JSON")
        assert json.loads(link.recv(timeout=BOUND))["type"] == "error"
    for path in ("/me", "/sessions", "/info"):
        assert httpx.get(server.api + path, headers=bearer(gateway), trust_env=False, verify=False).status_code == 403
    with pytest.raises(InvalidStatus):
        line(server, BASE + "/stop/line", bearer(gateway))
    with pytest.raises(InvalidStatus):  # and people's tokens don't make a rover, not even an admin's
        line(server, BASE + "/rover", bearer(tokens[Role.ADMIN]), subprotocols=[Subprotocol("footfall-rover-2")])


def test_the_servers_own_simulated_rover_comes_in(server):
    server.rover.start()
    live = server.sessions.current
    until(lambda: live.rover.frame, "telemetry of the simulated rover")


def test_who_is_removed_is_out_at_once_and_open_lines_end(server, accounts):
    accounts.add("tom", Role.VIEWER, PASSWORD, BOSS)
    with page(server) as made:
        log_in(made, "tom")
        cookie = {"Cookie": f"footfall={made.cookies['footfall']}"}
        with line(server, BASE + "/stop/line", cookie, origin=Origin(server.url)) as stops:
            stops.send("{}")
            assert json.loads(stops.recv(timeout=BOUND))["stopped"] is True
            accounts.remove("tom", BOSS)
            assert made.get(f"{BASE}/me").status_code == 401
            a_while(1.1)  # an open line looks again every second
            stops.send("{}")
            with pytest.raises(ConnectionClosed) as caught:
                stops.recv(timeout=BOUND)
            assert caught.value.rcvd is not None
            assert caught.value.rcvd.code == 1008


def test_an_open_stream_of_events_ends_with_the_token(server, accounts, tokens):
    token = accounts.add_token("listener", "vic", BOSS)
    events = server.api + "/sessions/current/events"
    with httpx.stream("GET", events, headers=bearer(token), timeout=BOUND, trust_env=False, verify=False) as stream:
        lines = stream.iter_lines()
        assert next(lines)
        accounts.revoke_token("listener", BOSS)
        a_while(1.1)
        note = {"text": "not for the listener"}
        for _ in range(2):
            httpx.post(
                server.api + "/sessions/current/notes",
                json=note,
                headers=bearer(tokens[Role.ADMIN]),
                trust_env=False,
                verify=False,
            )
        assert not [one for one in lines if "not for the listener" in one]


def test_stop_is_heard_while_the_accounts_cannot_be_read(server, accounts, monkeypatch, tokens):
    assert (
        httpx.get(server.api + "/me", headers=bearer(tokens[Role.VIEWER]), trust_env=False, verify=False).status_code
        == 200
    )

    def gone(*_):
        raise sqlite3.OperationalError("disk I/O error")

    monkeypatch.setattr(accounts._store, "key", gone)
    headers = bearer(tokens[Role.VIEWER])
    assert httpx.post(server.api + "/stop", headers=headers, trust_env=False, verify=False).status_code == 200
    assert httpx.get(server.api + "/me", headers=headers, trust_env=False, verify=False).status_code == 503
    assert httpx.post(server.api + "/stop", headers=bearer("unknown"), trust_env=False, verify=False).status_code == 503
    ready = httpx.get(server.url + "/health/ready", trust_env=False, verify=False)
    assert ready.status_code == 503
    assert [one["text"] for one in ready.json()["checks"] if not one["ok"]] == ["disk I/O error"]
    monkeypatch.setattr(accounts._store, "account", gone)
    refused = httpx.post(
        server.api + "/login", json={"name": "vic", "password": PASSWORD}, trust_env=False, verify=False
    )
    assert (refused.status_code, refused.json()["type"]) == (503, "/problems/accounts-unreadable")


def test_stop_does_not_wait_behind_requests_that_hang(server, monkeypatch, tokens):
    let_go = threading.Event()
    monkeypatch.setattr(server.sessions, "list", lambda: let_go.wait(BOUND) and [])
    headers = bearer(tokens[Role.VIEWER])

    def hang():
        httpx.get(server.api + "/sessions", headers=headers, timeout=BOUND, trust_env=False, verify=False)

    hanging = [threading.Thread(target=hang) for _ in range(45)]  # more than the pool has threads
    for thread in hanging:
        thread.start()
    try:
        until(lambda: _held_up(server, headers), "a pool without a free thread")
        answer = httpx.post(server.api + "/stop", headers=headers, timeout=BOUND, trust_env=False, verify=False)
        assert answer.json()["stopped"] is True
    finally:
        let_go.set()
        for thread in hanging:
            thread.join()


def _held_up(server, headers) -> bool:
    try:
        httpx.get(server.api + "/robot", headers=headers, timeout=1, trust_env=False, verify=False)
    except httpx.TimeoutException:
        return True
    return False


def test_an_answer_kept_for_a_repeated_request_is_not_given_to_others(server, tokens):
    note = {"text": "mine"}
    keyed = [{**bearer(tokens[role]), "Idempotency-Key": "the same"} for role in (Role.PLANNER, Role.VIEWER)]
    first = httpx.post(
        server.api + "/sessions/current/notes", json=note, headers=keyed[0], trust_env=False, verify=False
    )
    again = httpx.post(
        server.api + "/sessions/current/notes", json=note, headers=keyed[0], trust_env=False, verify=False
    )
    other = httpx.post(
        server.api + "/sessions/current/notes", json=note, headers=keyed[1], trust_env=False, verify=False
    )
    assert (first.status_code, again.status_code, other.status_code) == (201, 201, 403)
    assert again.headers["idempotent-replayed"] == "true"


CAMERA = {"type": "ViewerCameraMessage", "wxyz": (1, 0, 0, 0), "position": (0, 0, 5), "fov": 1.0, "near": 0.1}
CAMERA |= {"far": 100.0, "image_height": 480, "image_width": 640, "look_at": (0, 0, 0), "up_direction": (0, 0, 1)}
CLICK = {"type": "ScenePointerMessage", "event_type": "click", "ray_origin": (1, 1, 9), "ray_direction": (0, 0, -1)}
CLICK |= {"screen_pos": ((0.5, 0.5),), "modifier": None}


def test_a_viewers_clicks_in_the_scene_choose_nothing(server, tokens):
    """What viser's page sends is heard from a planner; from a viewer only where it looks from."""
    live = server.sessions.current
    live.terrains.load(plane(size=10.0, resolution=0.1), "made for this test")
    live.stances.set(stand(live.robot, live.get(live.state.dem)))
    for role in (Role.VIEWER, Role.PLANNER):
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        with line(server, "/scene", bearer(tokens[role]), subprotocols=[protocol]) as scene:
            scene.recv(timeout=BOUND)
            for message in (CAMERA, CLICK):
                scene.send(msgspec.msgpack.encode(message))
                a_while(0.5)
            if role is Role.VIEWER:
                assert live.state.footfall is None
            else:
                until(lambda: live.state.footfall, "a chosen footfall")
                chosen = [one for one in live.events() if one.type == "footfall_chosen"]
                assert [one.payload["by"]["name"] for one in chosen] == ["pia"]


def test_admins_read_who_there_is_and_what_was_done(server, tokens):
    admin = bearer(tokens[Role.ADMIN])
    everybody = httpx.get(server.api + "/accounts", headers=admin, trust_env=False, verify=False)
    assert {one["name"]: one["role"] for one in everybody.json()["accounts"]} == {n: r.value for n, r in NAMES.items()}
    record = httpx.get(server.api + "/audit?limit=1000", headers=admin, trust_env=False, verify=False)
    acts = [(one["who"], one["act"], one["client"]) for one in record.json()["entries"]]
    assert ("con", "login", "127.0.0.1") in acts
    assert ("con", "login refused", "127.0.0.1") in acts
    assert ("nobody", "token refused", "127.0.0.1") in acts
    for secret in [PASSWORD, *tokens.values()]:
        assert secret not in everybody.text + record.text
    after = httpx.get(server.api + "/audit?after=2&limit=1", headers=admin, trust_env=False, verify=False).json()[
        "entries"
    ]
    assert [one["seq"] for one in after] == [3]


def test_without_accounts_the_server_says_so(tmp_path):
    with running_server(tmp_path) as running:
        me = httpx.get(running.api + "/me", trust_env=False, verify=False).json()
        assert me["accounts"] is False
        assert me["notice"] == "no login: anyone on this computer can command"
        assert (
            httpx.post(
                running.api + "/login", json={"name": "a", "password": "b"}, trust_env=False, verify=False
            ).status_code
            == 409
        )


ELSEWHERE = {"accounts": True, "tls": False, "behind_tls_proxy": False, "public_url": None}


@pytest.mark.parametrize(
    ("host", "changes", "said"),
    [
        ("10.0.0.1", {"accounts": False}, "accounts add"),
        ("10.0.0.1", {"accounts": False, "tls": True}, "accounts add"),
        ("127.0.0.1", {"accounts": False, "behind_tls_proxy": True}, "accounts add"),
        ("127.0.0.1", {"accounts": False, "public_url": "https://ground.example"}, "accounts add"),
        ("10.0.0.1", {}, "--tls-cert"),
        ("0.0.0.0", {"tls": True}, "--public-url"),
        ("10.0.0.1", {"tls": True, "behind_tls_proxy": True}, "not at both"),
    ],
)
def test_nobody_from_elsewhere_comes_in_without_account_or_tls(host, changes, said):
    with pytest.raises(InvalidInput, match=said):
        require_safe(host, **{**ELSEWHERE, **changes})


@pytest.mark.parametrize(
    "url", ["http://ground.example", "https://", "https://a/b", "https://u@a", "ground", "https://a:x"]
)
def test_public_addresses_that_cannot_be(url):
    with pytest.raises(InvalidInput):
        Front.at(url, tls=True)


def test_hosts_and_origins_of_a_public_address():
    front = Front.at("https://Ground.Example:443/", proxied=True)

    def asked(host, origin=None, method="POST"):
        headers = [(b"host", host.encode()), (b"x-forwarded-for", b"10.0.0.9")]
        headers += [(b"origin", origin.encode())] if origin else []
        scope = {"type": "http", "method": method, "scheme": "http", "headers": headers}
        found = refusal(scope, front)
        return None if found is None else found[0]

    assert asked("ground.example", "https://ground.example") is None
    assert asked("127.0.0.1:8080", "https://ground.example") is None  # what some proxies make of it
    assert asked("ground.example", "http://example.org") == "foreign-origin"
    assert asked("example.org", "https://ground.example") == "foreign-host"
    assert asked("ground.example.evil.example") == "foreign-host"
