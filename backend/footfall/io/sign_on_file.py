"""``oidc.toml`` in the data folder: where people log in with the accounts of their organisation."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from footfall.core.errors import Conflict, InvalidInput
from footfall.core.misread import place_of
from footfall.core.written import utf8_of

FILE = "oidc.toml"
ROLES = ("viewer", "planner", "commander", "admin")
_TEXTS = ("issuer", "client_id")


@dataclass(frozen=True)
class SignOnSettings:
    """issuer: address of the OpenID provider. role_claim: names what a person is; name_claim: how a person is called.

    roles: FootFall's role → what the claim says of those who have it. client_secret: "" for a public client.
    """

    issuer: str
    client_id: str
    roles: Mapping[str, tuple[str, ...]]
    client_secret: str = ""
    role_claim: str = "groups"
    name_claim: str = "preferred_username"
    scope: str = "openid profile"


def read_sign_on(folder: Path) -> SignOnSettings | None:
    """What the file says; None where there is none. Raises InvalidInput, naming what is wrong; Conflict where others
    may read it though it holds a secret."""
    path = folder / FILE
    try:
        document = tomllib.loads(utf8_of(path.read_bytes()))
    except FileNotFoundError:
        return None
    except OSError as err:
        raise InvalidInput(f"{path}: {err.strerror}") from err
    except ValueError as err:
        raise InvalidInput(f"{path} is no readable TOML{place_of(err)}") from err
    roles = document.pop("roles", None)
    known = SignOnSettings.__dataclass_fields__.keys()
    _require(
        path, set(document) <= known, f"it knows {', '.join(sorted(known))}, not {', '.join(set(document) - known)}"
    )
    _require(path, all(isinstance(one, str) for one in document.values()), "all but the roles are texts")
    _require(path, all(document.get(name) for name in _TEXTS), f"it needs {' and '.join(_TEXTS)}")
    _require(path, _is_safe(document["issuer"]), "the issuer is an https address, or one of this computer")
    fits = isinstance(roles, dict) and roles and set(roles) <= set(ROLES)
    _require(path, fits, f"[roles] says for some of {', '.join(ROLES)} what the claim holds")
    if document.get("client_secret") and path.stat().st_mode & 0o077:
        raise Conflict(f"{path} holds a secret and others may read it; chmod 600 it")
    return SignOnSettings(roles={role: _texts(path, named) for role, named in roles.items()}, **document)


def _texts(path: Path, named: Any) -> tuple[str, ...]:
    texts = [named] if isinstance(named, str) else named
    _require(path, isinstance(texts, list) and all(isinstance(one, str) for one in texts), "a role has a list of texts")
    return tuple(texts)


def _is_safe(url: str) -> bool:
    parts = urlsplit(url)
    return parts.scheme == "https" or (parts.scheme == "http" and parts.hostname in ("127.0.0.1", "localhost", "::1"))


def _require(path: Path, fits: object, what: str) -> None:
    if not fits:
        raise InvalidInput(f"{path}: {what}")
