"""Login with an OpenID provider: authorization code with PKCE. What it says of a person is believed once it is proven.

OpenID Connect Core 1.0 §3.1, RFC 7636 (PKCE), RFC 9700 (what to watch for).
"""

import hashlib
import secrets
import threading
import time
from base64 import urlsafe_b64encode
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

import httpx

from footfall.core.errors import FootFallError
from footfall.io.sign_on_file import ROLES, SignOnSettings
from footfall.session.access.identity import Role

LASTS = 600.0
"""How long a login may be under way [s]."""
MOST = 1000
"""So many logins may be under way; of more the oldest are forgotten."""
LEEWAY = 60
"""By how much the clocks of provider and server may differ [s]."""
PATIENCE = 5.0
"""How long the provider may take for an answer [s]."""
# never "none", and never a secret that the provider shares with its clients
ALGORITHMS = ["RS256", "PS256", "ES256", "ES384", "EdDSA"]


class SignOnFailed(FootFallError):
    """``kind`` is what the login page tells of; the message is for the log."""

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind

    def __reduce__(self) -> tuple[type["SignOnFailed"], tuple[str, str]]:
        return type(self), (self.kind, self.message)


@dataclass(frozen=True)
class Person:
    """Who logged in. subject: what the provider never gives to another; name: what people call the person."""

    issuer: str
    subject: str
    name: str
    role: Role


@dataclass(frozen=True)
class _Begun:
    nonce: str
    verifier: str
    redirect: str
    at: float


class SignOn:
    """The logins under way with one provider. Thread-safe."""

    def __init__(self, settings: SignOnSettings, clock: Callable[[], float] = time.monotonic) -> None:
        self.settings = settings
        self._clock = clock
        self._begun: OrderedDict[str, _Begun] = OrderedDict()
        self._guard = threading.Lock()

    def begin(self, redirect: str) -> tuple[str, str]:
        """(where the browser has to go, the state that it has to bring back). Raises SignOnFailed."""
        state, nonce, verifier = (secrets.token_urlsafe(32) for _ in range(3))
        endpoint = self._discovered()["authorization_endpoint"]
        challenge = urlsafe_b64encode(hashlib.sha256(verifier.encode()).digest()).rstrip(b"=").decode()
        asked = {
            "response_type": "code",
            "client_id": self.settings.client_id,
            "redirect_uri": redirect,
            "scope": self.settings.scope,
            "state": state,
            "nonce": nonce,
            "code_challenge": challenge,
            "code_challenge_method": "S256",
        }
        with self._guard:
            self._begun[state] = _Begun(nonce, verifier, redirect, self._clock())
            while len(self._begun) > MOST:
                self._begun.popitem(last=False)
        return f"{endpoint}{'&' if '?' in endpoint else '?'}{urlencode(asked)}", state

    def end(self, state: str, code: str) -> Person:
        """Who came back with a code. A state serves once. Raises SignOnFailed."""
        with self._guard:
            begun = self._begun.pop(state, None)
        if begun is None or self._clock() - begun.at > LASTS:
            raise SignOnFailed("expired", "the login was not begun here, was used already, or took too long")
        about = self._discovered()
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": begun.redirect,
            "code_verifier": begun.verifier,
            "client_id": self.settings.client_id,
        }
        secret = self.settings.client_secret
        given = self._json(
            "POST", about["token_endpoint"], data={**form, **({"client_secret": secret} if secret else {})}
        )
        return self._person(self._proven(given.get("id_token"), about, begun.nonce))

    def keys(self) -> int:
        """With how many keys the provider signs; it is asked. Raises SignOnFailed."""
        keys = self._json("GET", self._discovered()["jwks_uri"]).get("keys")
        if not isinstance(keys, list) or not keys:
            raise SignOnFailed("unproven", f"{self.settings.issuer} tells no key that it signs with")
        return len(keys)

    def _discovered(self) -> dict[str, Any]:
        issuer = self.settings.issuer
        about = self._json("GET", f"{issuer.rstrip('/')}/.well-known/openid-configuration")
        if about.get("issuer") != issuer:
            raise SignOnFailed("unproven", f"{issuer} says that it is {about.get('issuer')!r}")
        wanted = ("authorization_endpoint", "token_endpoint", "jwks_uri")
        if not all(isinstance(about.get(name), str) for name in wanted):
            raise SignOnFailed("unreachable", f"{issuer} does not say where its {', '.join(wanted)} are")
        return about

    def _proven(self, token: Any, about: dict[str, Any], nonce: str) -> dict[str, Any]:
        # an extra: installed by those alone who have a provider
        from joserfc import jwt
        from joserfc.errors import JoseError
        from joserfc.jwk import KeySet

        try:
            keys = KeySet.import_key_set(self._json("GET", about["jwks_uri"]))  # type: ignore[arg-type]
            claims = jwt.decode(str(token), keys, algorithms=ALGORITHMS).claims
            jwt.JWTClaimsRegistry(
                leeway=LEEWAY,
                iss={"essential": True, "value": self.settings.issuer},
                aud={"essential": True, "value": self.settings.client_id},
                nonce={"essential": True, "value": nonce},
                sub={"essential": True},
                exp={"essential": True},
                iat={"essential": True},
            ).validate(claims)
        except (JoseError, ValueError, KeyError) as err:
            raise SignOnFailed("unproven", f"the provider's token is not accepted: {err}") from err
        if claims.get("azp", self.settings.client_id) != self.settings.client_id:
            raise SignOnFailed("unproven", "the provider's token was made for another program")
        return dict(claims)

    def _person(self, claims: dict[str, Any]) -> Person:
        said = claims.get(self.settings.role_claim, [])
        said = [said] if isinstance(said, str) else said if isinstance(said, list) else []
        roles = [Role(role) for role in ROLES if set(self.settings.roles.get(role, ())) & {str(one) for one in said}]
        name = str(claims.get(self.settings.name_claim) or claims["sub"])
        if not roles:
            raise SignOnFailed("no-role", f"{name} has no role here: {self.settings.role_claim} says {said}")
        return Person(self.settings.issuer, str(claims["sub"]), name, max(roles))

    def _json(self, method: str, url: str, **about: Any) -> dict[str, Any]:
        try:
            with httpx.Client(timeout=PATIENCE, follow_redirects=False) as client:
                answer = client.request(method, url, headers={"Accept": "application/json"}, **about)
            if answer.status_code == 200 and isinstance(found := answer.json(), dict):
                return found
            # a refusal of the code is the provider's answer; its text may hold what is secret
            kind = "refused" if method == "POST" and answer.status_code in (400, 401, 403) else "unreachable"
            raise SignOnFailed(kind, f"{url} answered {answer.status_code}")
        except (httpx.HTTPError, httpx.InvalidURL, ValueError) as err:
            raise SignOnFailed("unreachable", f"{url}: {err}") from err
