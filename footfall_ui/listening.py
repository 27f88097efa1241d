"""Where the server listens, and that nobody reaches it unrecognised or unencrypted from another computer."""

import resource
import socket
from dataclasses import dataclass
from pathlib import Path

from footfall.api.door.front import Front, is_loopback_name
from footfall.core.errors import Conflict, InvalidInput, NotFound

EVERYWHERE = ("0.0.0.0", "::")
MOST_FILES = 65_536
"""Files and connections that the server may have open, where the system lets it."""


def allow_many_files() -> None:
    """Take as many open files as the system gives without asking: the usual 1024 are soon used up."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST_FILES if hard == resource.RLIM_INFINITY else min(hard, MOST_FILES)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


@dataclass(frozen=True)
class Tls:
    """Files of the certificate (with those that vouch for it) and of its key, both PEM."""

    certificate: Path
    key: Path

    @classmethod
    def of(cls, certificate: Path | None, key: Path | None) -> "Tls | None":
        """Raises InvalidInput where one of the two is missing, NotFound where a file is."""
        if certificate is None or key is None:
            if certificate is not key:
                raise InvalidInput("--tls-cert and --tls-key go together")
            return None
        for path in (certificate, key):
            if not path.is_file():
                raise NotFound(f"there is no file {path}", path=str(path))
        return cls(certificate, key)


def require_safe(host: str, *, accounts: bool, tls: bool, behind_tls_proxy: bool, public_url: str | None) -> None:
    """Raises InvalidInput where somebody from another computer could come in without account, or without TLS."""
    here = is_loopback_name(host)
    if not accounts and (not here or behind_tls_proxy or public_url is not None):
        raise InvalidInput(
            f"without accounts FootFall serves this computer alone, not {public_url or host}: whoever reached it could "
            "move the rover. Make an account first with `footfall accounts add NAME --role admin`",
            host=host,
        )
    if tls and behind_tls_proxy:
        raise InvalidInput("TLS ends either here (--tls-cert) or at the proxy (--behind-tls-proxy), not at both")
    if not here and not (tls or behind_tls_proxy):
        raise InvalidInput(
            f"on {host} passwords would go over the network in the clear: give --tls-cert and --tls-key, "
            "or --behind-tls-proxy where a proxy in front does that",
            host=host,
        )
    if host in EVERYWHERE and public_url is None:
        raise InvalidInput(f"say with --public-url by which address browsers reach a server on {host}", host=host)


def front_of(listening: socket.socket, tls: bool, behind_tls_proxy: bool, public_url: str | None) -> Front:
    """How the outside reaches a socket. Raises InvalidInput for a public address that can't be."""
    host, port = listening.getsockname()[:2]
    address = None
    if not is_loopback_name(host):
        address = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        public_url = public_url or f"https://{address}"
    return Front.at(public_url, tls=tls, proxied=behind_tls_proxy, address=address)


def listen(host: str, port: int) -> socket.socket:
    """A listening socket. Raises InvalidInput for an impossible address, Conflict where the port is taken."""
    if not 0 <= port <= 65535:
        raise InvalidInput("a port is a number from 0 to 65535", port=port)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # asyncio sends at once (TCP_NODELAY) only where the socket names its protocol; else most answers take 40 ms more
    made = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((host, port))
        made.listen(128)
    except socket.gaierror as error:
        made.close()
        raise InvalidInput(f"{host} is no name or address of this computer", host=host) from error
    except OSError as error:
        made.close()
        raise Conflict(
            f"port {port} of {host} can't be used ({error.strerror}); end the other program, "
            "or choose another port with --port",
            port=port,
        ) from error
    return made


def address_of(listening: socket.socket, tls: bool = False) -> str:
    """``http://…`` (``https://…`` with TLS) of a listening socket, as this computer reaches it."""
    host, port = listening.getsockname()[:2]
    name = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(str(host), str(host))
    return f"http{'s' if tls else ''}://{f'[{name}]' if ':' in name else name}:{port}"
