"""Who may come in: accounts with passwords, logins of the page, tokens of programs and rovers; all of it on record.

Passwords are stored as argon2id hashes. Keys (logins, tokens) are 256 random bits, so SHA-256 keeps them as safe as
argon2 would, and is quick enough to look at with every request.
"""

import hashlib
import math
import re
import secrets
import sqlite3
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from footfall.core.errors import Conflict, FootFallError, InvalidInput, NotFound
from footfall.core.value import Value, value
from footfall.io.account_store import Account, AccountFile, AccountStore, AuditEntry, Change, Key
from footfall.session.access.identity import Identity, Role
from footfall.session.access.throttle import Throttle
from footfall.session.storage.interface import StoreRefused

LOGIN_LASTS = 12 * 3600.0
"""A login of the page ends after this long [s], used or not."""
TOKEN_LASTS_DAYS = 90
MOST_TOKEN_DAYS = 3650
SHORTEST_PASSWORD, LONGEST_PASSWORD = 12, 1024
MOST_REMEMBERED = 1000
"""Keys that were good when they were last looked at, kept for stop requests while the file can't be read."""
TOKEN_PREFIX = "footfall_"
"""Lets scanners for lost secrets know a token when they see one."""

_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,31}")
_RESERVED = ("local",)


class LoginRefused(FootFallError):
    """Name or password is wrong, or it was tried too often; ``retry_after`` [s] says when to try again."""

    kind = "login-refused"

    def __init__(self, message: str, retry_after: float = 0.0) -> None:
        super().__init__(message, retry_after=retry_after)
        self.retry_after = retry_after

    def __reduce__(self) -> tuple[type["LoginRefused"], tuple[str, float]]:
        return type(self), (self.message, self.retry_after)


@value
class Login(Value):
    """A login that was granted. secret: for the cookie, known here and there only. ends: [s since 1970]."""

    identity: Identity
    secret: str
    ends: float


@value
class Pass(Value):
    """What a key opens: the door for somebody, or the rover link (``identity`` None, ``rover`` its name)."""

    identity: Identity | None
    rover: str | None
    ends: float


class Accounts:
    """The accounts of one working folder; thread-safe. The command line may change them while a server reads them.

    store: where they are kept, this object's to close; a path: in that file. clock: seconds since 1970. hasher: of
    passwords; its cost is argon2-cffi's default.
    """

    def __init__(
        self,
        store: AccountStore | Path,
        clock: Callable[[], float] = time.time,
        hasher: PasswordHasher | None = None,
    ) -> None:
        """Raises Conflict where others may read the file, InvalidBundle where it is no such file."""
        self._store = AccountFile(store) if isinstance(store, Path) else store
        self._clock = clock
        self._hasher = hasher or PasswordHasher()
        self._by_name, self._by_address = Throttle(free=5), Throttle(free=20)
        self._bad_tokens = Throttle(free=5)
        self._remembered: OrderedDict[str, Pass] = OrderedDict()
        self._memory = threading.Lock()
        self._own_rover: Pass | None = None
        self._own_rover_hash = ""

    @cached_property
    def _nobody(self) -> str:
        """What a name that nobody has is compared with, so that it costs the same time as one that somebody has."""
        return self._hasher.hash(secrets.token_urlsafe())

    def close(self) -> None:
        """Harmless when done twice."""
        self._store.close()

    def everyone(self) -> list[Account]:
        """By name."""
        return self._store.accounts()

    def tokens(self) -> list[Key]:
        """By name; without their secrets, which nobody has but their owner."""
        return self._store.tokens()

    def audit(self, after: int = -1, limit: int = 1000) -> list[AuditEntry]:
        """Who did what, oldest first, from entry ``after`` on."""
        return self._store.audit(after, limit)

    def verify_audit(self) -> int:
        """Number of entries. Raises InvalidBundle where one was changed or lost."""
        return self._store.verify_audit()

    def add(self, name: str, role: Role, password: str, by: Identity) -> None:
        """Raises InvalidInput for a name or password that can't be, Conflict where the name is taken.

        The first account has to be an admin's.
        """
        if not _NAME.fullmatch(name) or name in _RESERVED:
            raise InvalidInput(
                "an account's name has 1 to 32 characters, small letters, digits, dot, hyphen and underscore, "
                f"begins with a letter or digit, and is not {', '.join(_RESERVED)}",
                name=name,
            )
        stored = self._hashed(password)
        with self._store.change() as change:
            if change.account(name) is not None:
                raise Conflict(f"there is an account {name} already", name=name)
            if not change.accounts() and role is not Role.ADMIN:
                raise Conflict("the first account is an admin's: it is the one that may make others", role=role.value)
            change.put_account(Account(name, role.value, stored, self._clock()))
            self._note(change, by, "account added", f"{name}, {role.value}")

    def remove(self, name: str, by: Identity) -> None:
        """With every login and token of it, at once. Raises NotFound, Conflict for the last admin."""
        with self._store.change() as change:
            self._require(change, name)
            _keep_an_admin(change, name)
            change.remove_account(name)
            self._note(change, by, "account removed", name)

    def set_role(self, name: str, role: Role, by: Identity) -> None:
        """From the next request on. Raises NotFound, Conflict for the last admin."""
        with self._store.change() as change:
            account = self._require(change, name)
            if role is not Role.ADMIN:
                _keep_an_admin(change, name)
            change.put_account(Account(name, role.value, account.password, account.created))
            self._note(change, by, "role changed", f"{name}, {account.role} to {role.value}")

    def set_password(self, name: str, password: str, by: Identity) -> None:
        """Ends every login of the account; tokens stay. Raises NotFound, InvalidInput."""
        stored = self._hashed(password)
        with self._store.change() as change:
            account = self._require(change, name)
            change.put_account(Account(name, account.role, stored, account.created))
            change.remove_logins(name)
            self._note(change, by, "password changed", name)

    def add_token(
        self,
        name: str,
        account: str | None,
        by: Identity,
        role: Role | None = None,
        days: float = TOKEN_LASTS_DAYS,
    ) -> str:
        """A token of an account, or of a rover where ``account`` is None. Its text is returned once and kept nowhere.

        role: the most that it may do; None: what its account may. Raises InvalidInput, NotFound, Conflict.
        """
        if not _NAME.fullmatch(name):
            raise InvalidInput("a token's name is made like an account's: small letters, digits, . - _", name=name)
        if not 0 < days <= MOST_TOKEN_DAYS:
            raise InvalidInput(f"a token lasts more than 0 and at most {MOST_TOKEN_DAYS} days", days=days)
        if account is None and role is not None:
            raise InvalidInput("a rover's token has no role: it opens the rover link alone")
        text = TOKEN_PREFIX + secrets.token_urlsafe(32)
        now = self._clock()
        use, most = "rover" if account is None else "token", None if role is None else role.value
        with self._store.change() as change:
            if account is not None:
                self._require(change, account)
            change.put_key(Key(_hash(text), use, name, account, most, now, now + days * 86400))
            whose = "the rover" if account is None else account
            self._note(change, by, "token added", f"{name} of {whose}" + (f", {most}" if most else ""))
        return text

    def revoke_token(self, name: str, by: Identity) -> None:
        """Raises NotFound."""
        with self._store.change() as change:
            found = change.token(name)
            if found is None:
                raise NotFound(f"there is no token {name}", name=name)
            change.remove_key(found.secret_hash)
            self._note(change, by, "token revoked", name)

    def own_rover(self) -> str:
        """A token for the rover that this very process runs; it is written nowhere and ends with the process."""
        text = TOKEN_PREFIX + secrets.token_urlsafe(32)
        self._own_rover, self._own_rover_hash = Pass(None, "of this server", math.inf), _hash(text)
        return text

    def log_in(self, name: str, password: str, client: str, replaced: str | None = None) -> Login:
        """A new login, with a secret that never was before; ``replaced``: that of the login it takes the place of.

        client: address that asks. Takes as long for a name that nobody has. Raises LoginRefused.
        """
        self._admit(name, client)
        nobody = self._nobody
        account = self._store.account(name) if _NAME.fullmatch(name) else None
        if not self._fits(nobody if account is None else account.password, password) or account is None:
            with self._store.change() as change:
                # what nobody is called may be a password in the wrong field: it is not written down
                who = "nobody" if account is None else name
                change.note(self._clock(), who, "login refused", "", client)
            raise LoginRefused("name or password is wrong")
        self._by_name.forget(name)
        self._by_address.uncount(client)  # else who has one account could try others without end
        secret, now = secrets.token_urlsafe(32), self._clock()
        identity = Identity(name, Role(account.role), client)
        with self._store.change() as change:
            present = change.account(name)
            if present is None or present.password != account.password:
                raise LoginRefused("the account was changed just now; log in again")
            self._add_login(change, secret, name, now, replaced)
            self._note(change, identity, "login", "")
        return Login(identity, secret, now + LOGIN_LASTS)

    def log_in_known(
        self, issuer: str, subject: str, name: str, role: Role, client: str, replaced: str | None = None
    ) -> Login:
        """A new login of somebody whom another authority has recognised; an account without password stands for it.

        issuer, subject: that authority, and what it never gives to anybody else. role: what it says now. Raises
        InvalidInput for a name that can't be one, Conflict where it is that of a local account, or of another person.
        """
        account = name.lower()
        if not _NAME.fullmatch(account) or account in _RESERVED:
            raise InvalidInput(
                f"{name!r} is no name of an account: small letters, digits, . - _, at most 32", name=name
            )
        marked = f"known {_hash(f'{issuer} {subject}')}"  # fits no password
        secret, now = secrets.token_urlsafe(32), self._clock()
        identity = Identity(account, role, client)
        with self._store.change() as change:
            found = change.account(account)
            if found is not None and found.password != marked:
                raise Conflict(f"there is another account {account}", name=account)
            if found is None or found.role != role.value:
                change.put_account(Account(account, role.value, marked, now if found is None else found.created))
                self._note(change, identity, "role given", f"{account}, {role.value}, by {issuer}")
            self._add_login(change, secret, account, now, replaced)
            self._note(change, identity, "login", issuer)
        return Login(identity, secret, now + LOGIN_LASTS)

    def _add_login(self, change: Change, secret: str, name: str, now: float, replaced: str | None) -> None:
        if replaced is not None:
            change.remove_key(_hash(replaced))
        change.remove_expired(now)
        change.put_key(Key(_hash(secret), "login", None, name, None, now, now + LOGIN_LASTS))

    def _admit(self, name: str, client: str) -> None:
        wait = self._by_name.attempt(name)
        if wait == 0:
            wait = self._by_address.attempt(client)
            if wait > 0:
                self._by_name.uncount(name)
        if wait > 0:
            raise LoginRefused(f"too many failed logins; try again in {math.ceil(wait)} s", wait)

    def log_out(self, secret: str, by: Identity) -> None:
        """The secret opens nothing from now on."""
        with self._store.change() as change:
            if change.remove_key(_hash(secret)):
                self._note(change, by, "logout", "")
        with self._memory:
            self._remembered.pop(_hash(secret), None)

    def by_cookie(self, secret: str, client: str) -> Pass | None:
        """Whose login this is; None where it is none, or no longer. Raises one of AccountsUnreadable."""
        return self._look(secret, client, ("login",))

    def by_token(self, text: str, client: str) -> Pass | None:
        """Whose token this is; None where it is none, or no longer. Raises one of AccountsUnreadable."""
        if self._own_rover is not None and secrets.compare_digest(_hash(text), self._own_rover_hash):
            return self._own_rover
        return self._look(text, client, ("token", "rover"))

    def token_refused(self, client: str) -> None:
        """Put a token that was no good on record; of a flood from one address only a few."""
        if self._bad_tokens.attempt(client) == 0:
            with self._store.change() as change:
                change.note(self._clock(), "nobody", "token refused", "", client)

    def remembered(self, secret: str) -> Pass | None:
        """What a key opened when it was last looked at; for stop requests, while the file can't be read."""
        with self._memory:
            found = self._remembered.get(_hash(secret))
        return found if found is not None and found.ends > self._clock() else None

    def _look(self, secret: str, client: str, uses: tuple[str, ...]) -> Pass | None:
        hashed = _hash(secret)
        found = self._store.key(hashed)
        opened = None
        if found is not None and found[0].use in uses and found[0].expires > self._clock():
            opened = _pass(found[0], found[1], client)
        with self._memory:
            self._remembered.pop(hashed, None)
            if opened is not None:
                self._remembered[hashed] = opened
            while len(self._remembered) > MOST_REMEMBERED:
                self._remembered.popitem(last=False)
        return opened

    def _fits(self, stored: str, password: str) -> bool:
        try:
            return self._hasher.verify(stored, _bytes(password))
        except (VerificationError, InvalidHashError):
            return False

    def _hashed(self, password: str) -> str:
        if not SHORTEST_PASSWORD <= len(password) <= LONGEST_PASSWORD:
            raise InvalidInput(f"a password has {SHORTEST_PASSWORD} to {LONGEST_PASSWORD} characters")
        return self._hasher.hash(_bytes(password))

    def _require(self, change: Change, name: str) -> Account:
        found = change.account(name)
        if found is None:
            raise NotFound(f"there is no account {name}", name=name)
        return found

    def _note(self, change: Change, by: Identity, act: str, what: str) -> None:
        change.note(self._clock(), by.name, act, what, by.client)


AccountsUnreadable = (sqlite3.Error, StoreRefused)
"""What is raised where they can't be read, or on a full disk not written."""


def _bytes(secret: str) -> bytes:
    # JSON may carry halves of characters, which UTF-8 proper has no bytes for
    return secret.encode(errors="surrogatepass")


def _hash(secret: str) -> str:
    return hashlib.sha256(_bytes(secret)).hexdigest()


def _pass(key: Key, role: str | None, client: str) -> Pass:
    if key.account is None or role is None:
        return Pass(None, key.name, key.expires)
    has = Role(role)
    most = has if key.role is None else min(has, Role(key.role))
    return Pass(Identity(key.account, most, client), None, key.expires)


def _keep_an_admin(change: Change, name: str) -> None:
    # one that a provider vouches for does not count: it may be out of reach
    others = (one for one in change.accounts() if one.name != name and one.role == Role.ADMIN.value)
    if all(one.password.startswith("known ") for one in others):
        raise Conflict(f"{name} is the last admin; make another one first", name=name)
