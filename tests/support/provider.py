"""A small OpenID provider on loopback that signs with a key of its own and keeps to PKCE; it can misbehave."""

import hashlib
import json
import secrets
import threading
import time
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlencode, urlsplit

from joserfc import jwt
from joserfc.jwk import ECKey, OctKey

CLIENT, SECRET = "footfall", "of this test"


class Provider:
    """person: what it says of whoever logs in. claims: what it adds to a token, or says wrongly; None leaves one out.

    key: what it signs with, of which ``keys`` tells the public part. elsewhere: what it says wrongly of where it is.
    instead: path → how it answers there. asked: paths that somebody asked for.
    """

    def __init__(self) -> None:
        self.person: dict[str, Any] = {"sub": "0815", "preferred_username": "ida", "groups": ["drivers"]}
        self.claims: dict[str, Any] = {}
        self.header = {"alg": "ES256", "kid": "one"}
        self.key: ECKey | OctKey = ECKey.generate_key("P-256", {"kid": "one"})
        self.keys: list[ECKey] = [self.key]
        self.refuses = False
        self.issuer = ""
        self.claimed_issuer = ""
        self.elsewhere: dict[str, Any] = {}
        self.instead: dict[str, Callable[[BaseHTTPRequestHandler], None]] = {}
        self.asked: list[str] = []
        self._codes: dict[str, dict[str, str]] = {}

    def about(self) -> dict[str, Any]:
        """The discovery document."""
        names = ("authorization_endpoint", "token_endpoint", "jwks_uri")
        where = {name: f"{self.issuer}/{name}" for name in names}
        return {"issuer": self.claimed_issuer or self.issuer, **where, **self.elsewhere}

    def authorize(self, asked: dict[str, str]) -> str:
        """Where the browser goes back to."""
        assert asked["response_type"] == "code"
        assert asked["code_challenge_method"] == "S256"
        assert "openid" in asked["scope"].split()
        if self.refuses:
            return f"{asked['redirect_uri']}?{urlencode({'error': 'access_denied', 'state': asked['state']})}"
        code = secrets.token_urlsafe()
        self._codes[code] = asked
        return f"{asked['redirect_uri']}?{urlencode({'code': code, 'state': asked['state']})}"

    def token(self, form: dict[str, str]) -> dict[str, Any] | None:
        """What a code is exchanged for; None: it is refused."""
        asked = self._codes.pop(form["code"], None)
        digest = hashlib.sha256(form["code_verifier"].encode()).digest()
        challenge = urlsafe_b64encode(digest).rstrip(b"=").decode()
        if asked is None or challenge != asked["code_challenge"]:
            return None
        if form["redirect_uri"] != asked["redirect_uri"] or form.get("client_secret") != SECRET:
            return None
        now = int(time.time())
        usual = {"iss": self.issuer, "aud": CLIENT, "nonce": asked["nonce"], "iat": now, "exp": now + 300}
        claims = {**usual, **self.person, **self.claims}
        told = {name: claim for name, claim in claims.items() if claim is not None}
        return {"access_token": "x", "token_type": "Bearer", "id_token": jwt.encode(self.header, told, self.key)}


@contextmanager
def provider() -> Iterator[Provider]:
    """It answers on ``.issuer`` until the context ends."""
    made = Provider()

    class Answers(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            parts = urlsplit(self.path)
            if self._instead():
                return
            if parts.path == "/.well-known/openid-configuration":
                self._tell(made.about())
            elif parts.path == "/jwks_uri":
                self._tell({"keys": [key.as_dict(private=False) for key in made.keys]})
            else:
                self.send_response(303)
                self.send_header("Location", made.authorize(_first(parts.query)))
                self.end_headers()

        def do_POST(self) -> None:
            # what is not read when the socket is closed resets the connection, and may take the answer with it
            asked = self.rfile.read(int(self.headers["Content-Length"])).decode()
            if self._instead():
                return
            given = made.token(_first(asked))
            self._tell(given or {"error": "invalid_grant"}, 200 if given else 400)

        def _instead(self) -> bool:
            path = urlsplit(self.path).path
            made.asked.append(path)
            other = made.instead.get(path)
            if other is not None:
                other(self)
            return other is not None

        def _tell(self, content: dict[str, Any], status: int = 200) -> None:
            body = json.dumps(content).encode()
            self.send_response(status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: object) -> None:
            """Says nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Answers)
    made.issuer = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
    thread.start()
    try:
        yield made
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def _first(query: str) -> dict[str, str]:
    return {name: given[0] for name, given in parse_qs(query).items()}
