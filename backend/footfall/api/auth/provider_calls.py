"""What is asked of an OpenID provider that may be hostile: where it may send us, how much it may say, for how long.

Its issuer was named by an admin. Every other address is what it says itself, and could be one that only this server
reaches (server-side request forgery): of another origin than the issuer's, public ones alone are asked.
"""

import ipaddress
import socket
import ssl
import time
from functools import cache
from typing import Any

import httpx

from footfall.core.errors import FootFallError
from footfall.core.strict_json import read_json

PATIENCE = 5.0
"""How long the provider may be silent [s]."""
LONGEST = 10.0
"""How long an answer may take to come [s]."""
MOST_BYTES = 256 << 10
"""Longest answer of a provider, as it comes."""
MOST_PARTS = 5000
"""Members and elements of one."""


class SignOnFailed(FootFallError):
    """``kind`` is what the login page tells of; the message is for the log."""

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind

    def __reduce__(self) -> tuple[type["SignOnFailed"], tuple[str, str]]:
        return type(self), (self.kind, self.message)


def ask(issuer: str, method: str, url: str, form: dict[str, str] | None = None) -> dict[str, Any]:
    """The JSON object that the provider answers with. Raises SignOnFailed."""
    try:
        status, said = _answer(method, *_where(issuer, url), form)
        if status == 200 and isinstance(found := read_json(said, most=MOST_PARTS), dict):
            return found
    except (httpx.HTTPError, httpx.InvalidURL, OSError, ValueError) as err:
        raise SignOnFailed("unreachable", f"{url:.200}: {err}") from err
    # a refusal of the code is the provider's answer; its text may hold what is secret
    kind = "refused" if method == "POST" and status in (400, 401, 403) else "unreachable"
    elsewhere = ", which leads elsewhere: it has to answer itself" if 300 <= status < 400 else ""
    raise SignOnFailed(kind, f"{url:.200} answered {status}{elsewhere}")


def require_address(issuer: str, name: str, url: Any) -> str:
    """An address that the provider says: of https, or of the issuer's own origin. Raises SignOnFailed."""
    try:
        address = httpx.URL(url)
        fits = address.scheme == "https" or (
            address.scheme == "http" and _origin(address) == _origin(httpx.URL(issuer))
        )
        fits = fits and bool(address.host) and not address.userinfo and not address.fragment
    except (httpx.InvalidURL, TypeError, ValueError):
        fits = False
    if not fits:
        raise SignOnFailed("unproven", f"{issuer} says that its {name} is {url!r:.200}, which is no https address")
    return str(url)


def _where(issuer: str, url: str) -> tuple[httpx.URL, str | None]:
    """(which address to ask, and the name that is behind it where the address is a number). Raises SignOnFailed."""
    wanted = httpx.URL(url)
    if _origin(wanted) == _origin(httpx.URL(issuer)):
        return wanted, None
    found = socket.getaddrinfo(wanted.host, wanted.port or 443, type=socket.SOCK_STREAM)
    numbers = [str(address[0]) for *_, address in found]
    inside = [number for number in numbers if not _is_public(number)]
    if inside:
        raise SignOnFailed(
            "unproven",
            f"{issuer} says to ask {url:.200}, which is {inside[0]}: an address that is not public is asked only under "
            "the issuer's own name and port; let the provider answer there",
        )
    # asked by number: a second look at the name could find another
    return wanted.copy_with(host=numbers[0]), wanted.host


def _is_public(number: str) -> bool:
    address = ipaddress.ip_address(number.partition("%")[0])
    within = [address]
    if isinstance(address, ipaddress.IPv6Address):
        within += [one for one in (address.ipv4_mapped, address.sixtofour) if one is not None]
        if address in _TRANSLATED:
            within.append(ipaddress.IPv4Address(address.packed[-4:]))
    return all(one.is_global and not one.is_multicast for one in within)


_TRANSLATED = ipaddress.IPv6Network("64:ff9b::/96")
"""IPv4 addresses as networks of IPv6 alone reach them (RFC 6052)."""


@cache
def _authorities() -> ssl.SSLContext:
    # reading the certificates of all of them takes as long as a whole login
    return httpx.create_ssl_context()


def _origin(url: httpx.URL) -> tuple[str, str, int | None]:
    return url.scheme, url.host, url.port or {"https": 443, "http": 80}.get(url.scheme)


def _answer(method: str, url: httpx.URL, name: str | None, form: dict[str, str] | None) -> tuple[int, bytes]:
    # what unpacks to far more than it is would be read whole
    headers = {"Accept": "application/json", "Accept-Encoding": "identity"}
    extensions = {}
    if name is not None:
        headers["Host"] = name if url.port is None else f"{name}:{url.port}"
        extensions = {"sni_hostname": name}
    ends, said = time.monotonic() + LONGEST, b""
    with (
        httpx.Client(timeout=PATIENCE, follow_redirects=False, verify=_authorities()) as client,
        client.stream(method, url, headers=headers, data=form, extensions=extensions) as answer,
    ):
        if answer.status_code != 200:
            return answer.status_code, b""
        if answer.headers.get("content-encoding", "identity") != "identity":
            raise ValueError("the answer is packed, though it was asked for as it is")
        for part in answer.iter_raw():
            said += part
            if len(said) > MOST_BYTES:
                raise ValueError(f"the answer has more than {MOST_BYTES} bytes")
            if time.monotonic() > ends:
                raise ValueError(f"the answer took more than {LONGEST:g} s to come")
        return answer.status_code, said
