"""How the outside reaches this server: by which names, with or without TLS, straight or through a proxy."""

from dataclasses import dataclass
from typing import Self
from urllib.parse import urlsplit

from footfall.core.errors import InvalidInput

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")


def is_loopback_name(name: str | None) -> bool:
    """Whether a host name or address means this computer."""
    return name in LOOPBACK_NAMES


@dataclass(frozen=True)
class Front:
    """public: origin under which browsers elsewhere know this server (``https://ground.example``); None: nowhere.

    secure: whether browsers reach it over TLS. proxied: whether a proxy is allowed to pass requests on.
    address: ``host:port`` that it listens on, where that is not this computer's loopback.
    """

    public: str | None = None
    secure: bool = False
    proxied: bool = False
    address: str | None = None

    @classmethod
    def at(
        cls, public_url: str | None, *, tls: bool = False, proxied: bool = False, address: str | None = None
    ) -> Self:
        """Raises InvalidInput for an address that is no https origin, or that nothing here makes secure."""
        if public_url is None:
            return cls(None, tls, proxied, address)
        try:
            parts = urlsplit(public_url)
            right = parts.scheme == "https" and parts.hostname and not parts.username and parts.port != 0
        except ValueError:
            right = False
        if not right or parts.path.strip("/") or parts.query or parts.fragment:
            raise InvalidInput(
                "the public address is scheme, name and port alone, as https://ground.example:8443", url=public_url
            )
        if not (tls or proxied):
            raise InvalidInput("a public address needs --tls-cert and --tls-key, or --behind-tls-proxy", url=public_url)
        port = "" if parts.port in (None, 443) else f":{parts.port}"
        name = f"[{parts.hostname}]" if ":" in str(parts.hostname) else parts.hostname
        return cls(f"https://{name}{port}", True, proxied, address)

    @property
    def hosts(self) -> tuple[str, ...]:
        """What the ``Host`` header of a request from elsewhere may say."""
        named = None if self.public is None else self.public.removeprefix("https://")
        return tuple(one for one in (named, self.address) if one)


LOOPBACK = Front()
"""Reached on this computer alone, without TLS."""
