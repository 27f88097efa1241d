"""Login with an OpenID provider: authorization code with PKCE. What it says of a person is believed once it is proven.

OpenID Connect Core 1.0 §3.1, RFC 7636 (PKCE), RFC 9700 (what to watch for).
"""

import contextlib
import hashlib
import secrets
import threading
import time
from base64 import urlsafe_b64encode
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

from footfall.api.auth.provider_calls import SignOnFailed, ask, require_address
from footfall.io.sign_on_file import ROLES, SignOnSettings
from footfall.session.access.identity import Role

LASTS = 600.0
"""How long a login may be under way [s]."""
MOST = 1000
"""So many logins may be under way; of more the oldest are forgotten."""
LEEWAY = 60
"""By how much the clocks of provider and server may differ [s]."""
AT_ONCE = 10
"""So many logins wait for the provider at once: who is not logged in yet must not take all threads of the server."""
MOST_KEYS = 100
"""Keys that a provider may have."""
LONGEST_SUBJECT = 255
"""OpenID Connect Core 1.0, §2."""
# never "none", and never a secret that the provider shares with its clients
ALGORITHMS = ["RS256", "PS256", "ES256", "ES384", "EdDSA"]


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
        self._asking = threading.BoundedSemaphore(AT_ONCE)

    def begin(self, redirect: str) -> tuple[str, str]:
        """(where the browser has to go, the state that it has to bring back). Raises SignOnFailed."""
        state, nonce, verifier = (secrets.token_urlsafe(32) for _ in range(3))
        with self._in_turn():
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
        with self._in_turn():
            return self._asked_for(begun, code)

    def _asked_for(self, begun: _Begun, code: str) -> Person:
        about = self._discovered()
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": begun.redirect,
            "code_verifier": begun.verifier,
            "client_id": self.settings.client_id,
        }
        secret = self.settings.client_secret
        form |= {"client_secret": secret} if secret else {}
        given = ask(self.settings.issuer, "POST", about["token_endpoint"], form)
        return self._person(self._proven(given.get("id_token"), about, begun.nonce))

    def keys(self) -> int:
        """With how many keys the provider signs; it is asked. Raises SignOnFailed."""
        return len(self._keys(self._discovered()))

    @contextlib.contextmanager
    def _in_turn(self) -> Iterator[None]:
        if not self._asking.acquire(blocking=False):
            raise SignOnFailed("unreachable", f"{AT_ONCE} logins wait for {self.settings.issuer} already")
        try:
            yield
        finally:
            self._asking.release()

    def _discovered(self) -> dict[str, str]:
        issuer = self.settings.issuer
        about = ask(issuer, "GET", f"{issuer.rstrip('/')}/.well-known/openid-configuration")
        if about.get("issuer") != issuer:
            raise SignOnFailed("unproven", f"{issuer} says that it is {about.get('issuer')!r:.200}")
        wanted = ("authorization_endpoint", "token_endpoint", "jwks_uri")
        return {name: require_address(issuer, name, about.get(name)) for name in wanted}

    def _keys(self, about: dict[str, str]) -> list[Any]:
        keys = ask(self.settings.issuer, "GET", about["jwks_uri"]).get("keys")
        if not isinstance(keys, list) or not 0 < len(keys) <= MOST_KEYS:
            raise SignOnFailed(
                "unproven", f"{self.settings.issuer} has to tell 1 to {MOST_KEYS} keys that it signs with"
            )
        return keys

    def _proven(self, token: Any, about: dict[str, str], nonce: str) -> dict[str, Any]:
        # an extra: installed by those alone who have a provider
        from joserfc import jwt
        from joserfc.errors import JoseError
        from joserfc.jwk import KeySet

        named_keys = self._keys(about)
        try:
            keys = KeySet.import_key_set({"keys": named_keys})
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
            subject = claims["sub"]
            if not isinstance(subject, str) or not 0 < len(subject) <= LONGEST_SUBJECT:
                raise ValueError(f"its subject is no text of 1 to {LONGEST_SUBJECT} characters")
        except (JoseError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as err:
            # the library expects keys, headers and claims of the right types
            raise SignOnFailed("unproven", f"the provider's token is not accepted: {err!s:.200}") from err
        if claims.get("azp", self.settings.client_id) != self.settings.client_id:
            raise SignOnFailed("unproven", "the provider's token was made for another program")
        return dict(claims)

    def _person(self, claims: dict[str, Any]) -> Person:
        said = claims.get(self.settings.role_claim, [])
        said = [said] if isinstance(said, str) else said if isinstance(said, list) else []
        roles = [Role(role) for role in ROLES if set(self.settings.roles.get(role, ())) & {str(one) for one in said}]
        name = str(claims.get(self.settings.name_claim) or claims["sub"])
        if not roles:
            raise SignOnFailed(
                "no-role", f"{name:.100} has no role here: {self.settings.role_claim} says {said!s:.200}"
            )
        return Person(self.settings.issuer, str(claims["sub"]), name, max(roles))
