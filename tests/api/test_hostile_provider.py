"""A provider of logins that lies about where it is, says too much, or never comes to an end."""

import gzip
import json
import socket
import threading
from base64 import urlsafe_b64encode
from contextlib import suppress
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest

from footfall.api.auth import oidc, provider_calls
from footfall.api.auth.oidc import SignOn
from footfall.api.auth.provider_calls import SignOnFailed
from footfall.io.sign_on_file import SignOnSettings
from tests.support.provider import CLIENT, SECRET, provider
from tests.support.waiting import BOUND

BACK = "http://127.0.0.1/back"
DISCOVERY = "/.well-known/openid-configuration"


@pytest.fixture(scope="module")
def hostile():
    with provider() as made:
        yield made


@pytest.fixture(scope="module")
def inside():
    """A server that only this machine reaches."""
    with provider() as made:
        yield made


@pytest.fixture
def issuing(hostile):
    before = dict(vars(hostile))
    hostile.elsewhere, hostile.instead, hostile.claims, hostile.asked = {}, {}, {}, []
    yield hostile
    vars(hostile).update(before)


@pytest.fixture
def sign_on(issuing):
    return SignOn(SignOnSettings(issuing.issuer, CLIENT, {"viewer": ("drivers",)}, SECRET))


def log_in(sign_on):
    address, state = sign_on.begin(BACK)
    back = httpx.get(address, trust_env=False, verify=False).headers["location"]
    return sign_on.end(state, parse_qs(urlsplit(back).query)["code"][0])


def refused(sign_on, kind="unproven"):
    with pytest.raises(SignOnFailed) as caught:
        log_in(sign_on)
    assert caught.value.kind == kind
    assert len(caught.value.message) < 1000
    return caught.value.message


def resolving(monkeypatch, **numbers):
    """Names that are known, and nothing else: name → numbers."""
    known = {"127.0.0.1": ["127.0.0.1"], **{name.replace("_", "."): told for name, told in numbers.items()}}

    looked_up = []

    def look_up(host, port, *_, **about):
        looked_up.append(host)
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (number, port)) for number in known[host]]

    monkeypatch.setattr(provider_calls.socket, "getaddrinfo", look_up)
    return looked_up


# -- where it sends us ------------------------------------------------------------------------


@pytest.mark.parametrize("endpoint", ["jwks_uri", "token_endpoint"])
def test_no_login_leads_to_what_only_this_server_reaches(issuing, sign_on, inside, endpoint):
    inside.asked.clear()
    issuing.elsewhere = {endpoint: f"https://127.0.0.1:{urlsplit(inside.issuer).port}/{endpoint}"}
    assert "not public" in refused(sign_on)
    assert inside.asked == []


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "localhost", "[::1]", "[::ffff:127.0.0.1]", "2130706433", "0x7f.1", "0.0.0.0", "169.254.169.254",
     "10.0.0.1", "192.168.1.1", "100.64.0.1", "224.0.0.1", "[fe80::1]", "[64:ff9b::a00:1]", "[2002:a00:1::]"],
)  # fmt: skip
def test_no_address_is_asked_that_is_not_public(issuing, host):
    with pytest.raises(SignOnFailed, match="not public") as caught:
        provider_calls.ask(issuing.issuer, "GET", f"https://{host}/x")
    assert caught.value.kind == "unproven"


@pytest.mark.parametrize("numbers", [["10.0.0.1"], ["93.184.215.14", "127.0.0.1"]])
def test_nor_is_one_whose_name_says_nothing_of_it(issuing, monkeypatch, numbers):
    resolving(monkeypatch, keys_example=numbers)
    with pytest.raises(SignOnFailed, match="not public"):
        provider_calls.ask(issuing.issuer, "POST", "https://keys.example/token", {"code": "x"})


def test_a_public_address_is_asked_by_the_number_that_was_looked_at_under_its_own_name(issuing, monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        looked_up = resolving(monkeypatch, keys_example=["127.0.0.1"])
        monkeypatch.setattr(provider_calls, "_is_public", lambda number: True)
        heard = []

        def hear():
            came, _ = listening.accept()
            with came:
                heard.append(came.recv(1 << 16))

        hearing = threading.Thread(target=hear)
        hearing.start()
        monkeypatch.setattr(provider_calls.httpx, "Client", without_proxies(provider_calls.httpx.Client))
        with pytest.raises(SignOnFailed):
            provider_calls.ask(issuing.issuer, "GET", f"https://keys.example:{port}/keys")
        hearing.join(BOUND)
    assert looked_up.count("keys.example") == 1  # a second look could find another number
    assert b"keys.example" in heard[0]  # the name that the certificate has to be of


def without_proxies(client):
    return lambda **about: client(**about, trust_env=False)


@pytest.mark.parametrize("endpoint", ["authorization_endpoint", "jwks_uri", "token_endpoint"])
def test_nobody_goes_to_an_address_that_is_none(issuing, sign_on, endpoint):
    issuing.elsewhere = {endpoint: "http://elsewhere.example/x"}
    assert endpoint in refused(sign_on)
    assert set(issuing.asked) == {DISCOVERY}


@pytest.mark.parametrize(
    "address",
    ["file:///etc/passwd", "javascript:alert(1)", "//elsewhere.example", "", "https://", 7, None, ["https://x.example"],
     "https://a:b@elsewhere.example", "https://x.example/#y", "https://x\r\nY: z/"],
)  # fmt: skip
def test_only_https_is_an_address(issuing, address):
    with pytest.raises(SignOnFailed, match="no https address"):
        provider_calls.require_address(issuing.issuer, "jwks_uri", address)
    for right in ("https://x.example/y?z=1", f"{issuing.issuer}/x"):
        assert provider_calls.require_address(issuing.issuer, "jwks_uri", right) == right


@pytest.mark.parametrize(("path", "code"), [(DISCOVERY, 302), ("/jwks_uri", 301), ("/token_endpoint", 307)])
def test_nobody_is_led_elsewhere(issuing, sign_on, inside, path, code):
    inside.asked.clear()

    def lead(request):
        request.send_response(code)
        request.send_header("Location", f"{inside.issuer}{path}")
        request.end_headers()

    issuing.instead = {path: lead}
    assert f"answered {code}, which leads elsewhere" in refused(sign_on, "unreachable")
    assert inside.asked == []


# -- what it says -----------------------------------------------------------------------------


def telling(body, **headers):
    def tell(request):
        request.send_response(200)
        for name, text in headers.items():
            request.send_header(name.replace("_", "-"), text)
        request.end_headers()
        with suppress(OSError):
            request.wfile.write(body)

    return tell


def endless(request):
    request.send_response(200)
    request.end_headers()
    with suppress(OSError):
        while True:
            request.wfile.write(b" " * (1 << 16))


BODIES = {
    "without an end": (endless, "more than 262144 bytes"),
    "packed": (telling(gzip.compress(b" " * (1 << 20)), Content_Encoding="gzip"), "packed"),
    "deep": (telling(b"[" * 5000), ""),
    "of many parts": (telling(b'{"keys": [' + b"1," * 50_000 + b"1]}"), "more than"),
    "no object": (telling(b"[]"), ""),
    "no JSON": (telling(b"<html>"), ""),
    "no text": (telling(b'"\xff"'), ""),
    "twice": (telling(b'{"keys": [], "keys": []}'), "given twice"),
}


@pytest.mark.parametrize("path", [DISCOVERY, "/jwks_uri", "/token_endpoint"])
@pytest.mark.parametrize(("answer", "why"), BODIES.values(), ids=BODIES)
def test_what_is_no_answer_is_refused_and_not_read_to_its_end(issuing, sign_on, path, answer, why):
    issuing.instead = {path: answer}
    assert why in refused(sign_on, "unreachable")


@pytest.mark.parametrize(
    "keys", [None, {}, [], [7], ["a"], [None], [{}], [{"kty": 1}], [{"kty": "RSA", "n": 7}], [{}] * 101]
)
def test_what_are_no_keys_is_refused(issuing, sign_on, keys):
    issuing.instead = {"/jwks_uri": telling(json.dumps({"keys": keys}).encode())}
    refused(sign_on)


HEADERS = [
    {"alg": ["ES256"], "kid": "one"}, {"alg": {}, "kid": "one"}, {"alg": "none"}, {"alg": None}, {}, [], 7,
    {"alg": "ES256", "kid": ["one"]}, {"alg": "ES256", "kid": "one", "crit": ["x"]}, {"alg": "ES256", "crit": 7},
]  # fmt: skip


def segment(content):
    return urlsafe_b64encode(json.dumps(content).encode()).rstrip(b"=").decode()


@pytest.mark.parametrize(
    "token",
    [
        None,
        7,
        [],
        {},
        "",
        "a.b.c",
        "....",
        "a.b.c.d.e",
        "\u00e9.b.c",
        *(f"{segment(one)}.{segment({})}.AAAA" for one in HEADERS),
    ],
)
def test_what_is_no_token_is_refused(issuing, sign_on, token):
    issuing.instead = {"/token_endpoint": telling(json.dumps({"id_token": token}).encode())}
    refused(sign_on)


@pytest.mark.parametrize("subject", ["", "x" * 256, 7, {"a": 1}, ["0815"], True])
def test_a_person_without_a_proper_subject_is_nobody(issuing, sign_on, subject):
    issuing.claims = {"sub": subject}
    refused(sign_on)


def test_a_provider_that_falls_silent_takes_no_more_than_its_share(issuing, sign_on, monkeypatch):
    monkeypatch.setattr(sign_on, "_asking", threading.BoundedSemaphore(1))
    came, go_on = threading.Event(), threading.Event()

    def silent(request):
        came.set()
        assert go_on.wait(BOUND)
        telling(json.dumps(issuing.about()).encode())(request)

    monkeypatch.setattr(provider_calls, "PATIENCE", BOUND)
    monkeypatch.setattr(provider_calls, "LONGEST", BOUND)
    issuing.instead = {DISCOVERY: silent}
    waiting = threading.Thread(target=sign_on.begin, args=(BACK,))
    waiting.start()
    assert came.wait(BOUND)
    with pytest.raises(SignOnFailed, match="wait for") as caught:
        sign_on.begin(BACK)
    assert caught.value.kind == "unreachable"
    go_on.set()
    waiting.join(BOUND)
    issuing.instead = {}
    assert log_in(sign_on).name == "ida"
    assert oidc.AT_ONCE < 40  # threads of the server
