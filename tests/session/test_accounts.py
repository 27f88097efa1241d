"""Accounts, their logins and tokens, and the record: who gets in, who no longer does, and what stays secret."""

import os
import re
import sqlite3
import stat
import threading

import pytest
from argon2 import PasswordHasher, extract_parameters
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from footfall import logs
from footfall.core.errors import Conflict, InvalidBundle, InvalidInput, NotFound
from footfall.io.account_store import FILE
from footfall.session.access.account_stores import account_store, keep_to_owner
from footfall.session.access.accounts import LOGIN_LASTS, Accounts, LoginRefused
from footfall.session.access.identity import Identity, Role
from footfall.session.access.throttle import LONGEST_WAIT, Throttle
from footfall.session.registry import Sessions
from footfall.session.storage.databases import binding
from footfall.session.storage.sqlite_log import DATABASE

BOSS = Identity("boss", Role.ADMIN, "command line")
PASSWORD = "a long and good one"
# the cheapest that argon2 has: these tests are about who gets in, not about how slow guessing is
QUICK = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)


class Clock:
    def __init__(self):
        self.now = 1.8e9

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def accounts(work, clock):
    """Once in a file, once on a database server."""
    made = Accounts(account_store(work), clock, QUICK)
    made.add("ada", Role.ADMIN, PASSWORD, BOSS)
    made.add("vic", Role.VIEWER, PASSWORD, BOSS)
    yield made
    made.close()


@pytest.fixture
def in_file(tmp_path, clock):
    made = Accounts(tmp_path / FILE, clock, QUICK)
    made.add("ada", Role.ADMIN, PASSWORD, BOSS)
    made.add("vic", Role.VIEWER, PASSWORD, BOSS)
    yield made
    made.close()


def who(found):
    return None if found is None or found.identity is None else (found.identity.name, found.identity.role)


def test_a_login_opens_until_it_ends(accounts, clock):
    login = accounts.log_in("vic", PASSWORD, "10.0.0.7")
    assert who(accounts.by_cookie(login.secret, "10.0.0.7")) == ("vic", Role.VIEWER)
    assert accounts.by_token(login.secret, "10.0.0.7") is None  # a cookie's secret is no token
    clock.now += LOGIN_LASTS - 1
    assert accounts.by_cookie(login.secret, "") is not None
    clock.now += 1
    assert accounts.by_cookie(login.secret, "") is None


def test_each_login_has_a_secret_of_its_own_and_replaces_the_one_before(accounts):
    first = accounts.log_in("vic", PASSWORD, "")
    second = accounts.log_in("vic", PASSWORD, "", replaced=first.secret)
    assert first.secret != second.secret
    assert accounts.by_cookie(first.secret, "") is None
    accounts.log_out(second.secret, second.identity)
    assert accounts.by_cookie(second.secret, "") is None


def test_a_removed_account_is_out_at_once_in_every_process(accounts, work):
    login = accounts.log_in("vic", PASSWORD, "")
    token = accounts.add_token("script", "vic", BOSS)
    assert accounts.by_cookie(login.secret, "") is not None
    other = Accounts(account_store(work), hasher=QUICK)  # as the command line opens it beside a server
    other.remove("vic", BOSS)
    other.close()
    if binding(work) is not None:
        accounts._store._look()  # a database server is asked every second
    assert accounts.by_cookie(login.secret, "") is None
    assert accounts.by_token(token, "") is None
    with pytest.raises(LoginRefused):
        accounts.log_in("vic", PASSWORD, "")


def test_another_password_ends_the_logins_and_another_role_counts_at_once(accounts):
    login = accounts.log_in("vic", PASSWORD, "")
    accounts.set_role("vic", Role.COMMANDER, BOSS)
    assert who(accounts.by_cookie(login.secret, "")) == ("vic", Role.COMMANDER)
    accounts.set_password("vic", "quite another one", BOSS)
    assert accounts.by_cookie(login.secret, "") is None
    assert accounts.log_in("vic", "quite another one", "").identity.name == "vic"


def test_tokens_do_at_most_what_they_and_their_account_may(accounts, clock):
    narrow = accounts.add_token("narrow", "ada", BOSS, Role.PLANNER, days=2)
    wide = accounts.add_token("wide", "vic", BOSS, Role.ADMIN)
    link = accounts.add_token("gateway", None, BOSS)
    assert who(accounts.by_token(narrow, "")) == ("ada", Role.PLANNER)
    assert who(accounts.by_token(wide, "")) == ("vic", Role.VIEWER)
    opened = accounts.by_token(link, "")
    assert opened is not None
    assert (opened.identity, opened.rover) == (None, "gateway")
    assert accounts.by_cookie(narrow, "") is None  # a token is no cookie
    clock.now += 2 * 86400
    assert accounts.by_token(narrow, "") is None
    accounts.revoke_token("wide", BOSS)
    assert accounts.by_token(wide, "") is None
    with pytest.raises(NotFound, match="wide"):
        accounts.revoke_token("wide", BOSS)
    with pytest.raises(Conflict, match="gateway"):
        accounts.add_token("gateway", "ada", BOSS)


def test_somebody_always_remains_who_may_make_accounts(work, clock):
    fresh = Accounts(account_store(work), clock, QUICK)
    with pytest.raises(Conflict, match="first account"):
        fresh.add("vic", Role.VIEWER, PASSWORD, BOSS)
    fresh.add("ada", Role.ADMIN, PASSWORD, BOSS)
    for change in (lambda: fresh.remove("ada", BOSS), lambda: fresh.set_role("ada", Role.VIEWER, BOSS)):
        with pytest.raises(Conflict, match="last admin"):
            change()
    assert [one.name for one in fresh.everyone()] == ["ada"]
    fresh.close()


@pytest.mark.parametrize("name", ["", "local", "Ada", "a b", "a" * 33, "../a", "ada\n", ".a", "é"])
def test_names_that_cannot_be(in_file, name):
    with pytest.raises(InvalidInput, match="small letters"):
        in_file.add(name, Role.VIEWER, PASSWORD, BOSS)


@pytest.mark.parametrize("password", ["", "short", "x" * 1025])
def test_passwords_that_cannot_be(in_file, password):
    with pytest.raises(InvalidInput, match="12 to 1024"):
        in_file.add("new", Role.VIEWER, password, BOSS)


def test_guessing_is_slowed_down_for_the_account_and_for_the_address(tmp_path, clock):
    accounts = Accounts(tmp_path / FILE, clock, QUICK)
    accounts.add("ada", Role.ADMIN, PASSWORD, BOSS)
    for i in range(5):  # from as many addresses
        with pytest.raises(LoginRefused, match="wrong"):
            accounts.log_in("ada", "a wrong password", f"10.0.0.{i}")
    with pytest.raises(LoginRefused, match="too many") as caught:
        accounts.log_in("ada", PASSWORD, "10.0.1.1")
    assert caught.value.retry_after > 0
    for i in range(20):  # one address, as many names
        with pytest.raises(LoginRefused):
            accounts.log_in(f"nobody{i}", "a wrong password", "10.9.9.9")
    accounts.add("ben", Role.VIEWER, PASSWORD, BOSS)
    with pytest.raises(LoginRefused, match="too many"):
        accounts.log_in("ben", PASSWORD, "10.9.9.9")
    assert accounts.log_in("ben", PASSWORD, "10.9.9.8").identity.name == "ben"
    accounts.close()


def test_many_guesses_at_once_are_not_more_than_one_after_the_other(in_file):
    heard = []

    def guess():
        with pytest.raises(LoginRefused) as caught:
            in_file.log_in("vic", "a wrong password", "10.0.0.1")
        heard.append(caught.value.retry_after)

    threads = [threading.Thread(target=guess) for _ in range(30)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(wait == 0 for wait in heard) == 5


def test_a_name_that_nobody_has_costs_as_much_time(tmp_path):
    """By what is worked out, not by a clock: one comparison each, of equal cost, with the password that was given."""
    compared = []

    class Watched(PasswordHasher):
        def verify(self, hash, password):
            assert isinstance(hash, str)
            compared.append((extract_parameters(hash), password))
            return super().verify(hash, password)

    accounts = Accounts(tmp_path / FILE, hasher=Watched(time_cost=2, memory_cost=64, parallelism=1))
    accounts.add("ada", Role.ADMIN, PASSWORD, BOSS)
    costs = []
    for name in ("ada", "nobody", "no name at all"):
        with pytest.raises(LoginRefused, match="name or password is wrong"):
            accounts.log_in(name, f"a wrong password of {name}", "10.0.0.1")
        ((cost, password),) = compared
        assert password == f"a wrong password of {name}".encode()
        costs.append(cost)
        compared.clear()
    assert costs[0].time_cost == 2
    assert costs == [costs[0]] * 3
    accounts.close()


def test_the_file_is_its_owners_alone(in_file, tmp_path):
    login = in_file.log_in("vic", PASSWORD, "")  # writes, so that the files beside it are there
    found = list(tmp_path.iterdir())
    assert len(found) >= 2
    assert {stat.S_IMODE(path.stat().st_mode) for path in found} == {0o600}
    (tmp_path / FILE).chmod(0o640)
    with pytest.raises(Conflict, match="chmod 600"):
        Accounts(tmp_path / FILE)
    assert in_file.by_cookie(login.secret, "") is not None


def test_a_log_beside_accounts_is_its_owners_alone(tmp_path):
    before = os.umask(0o022)
    try:
        with Sessions(tmp_path) as sessions:
            sessions.create("open to all")
            assert stat.S_IMODE((tmp_path / DATABASE).stat().st_mode) == 0o644
            # as the program begins it, before it looks whether there are accounts
            lines = tmp_path / logs.FOLDER / logs.FILE
            lines.parent.mkdir()
            lines.touch()
            keep_to_owner(tmp_path)
            made = sessions.create("after that")
            found = [lines, *tmp_path.glob(f"{DATABASE}*"), *(tmp_path / made.id).iterdir()]
            assert len(found) > 3
            assert [path for path in found if stat.S_IMODE(path.stat().st_mode) & 0o077] == []
    finally:
        os.umask(before)


def test_no_secret_is_in_any_file_or_in_the_record(in_file, tmp_path):
    login = in_file.log_in("vic", PASSWORD, "10.0.0.7")
    secrets = [PASSWORD, login.secret, in_file.add_token("script", "vic", BOSS), in_file.own_rover()]
    secrets += [in_file.add_token("gateway", None, BOSS), "typed into the name field"]
    with pytest.raises(LoginRefused):
        in_file.log_in("typed into the name field", "x", "")
    written = b"".join(path.read_bytes() for path in tmp_path.iterdir())
    for secret in secrets:
        assert secret.encode() not in written
        assert secret.encode()[9:] not in written
    assert re.search(rb"\$argon2id\$", written)


def test_the_record_is_only_added_to_and_shows_what_was_changed(in_file, tmp_path):
    in_file.log_in("vic", PASSWORD, "10.0.0.7")
    with pytest.raises(LoginRefused):
        in_file.log_in("vic", "a wrong password", "10.0.0.8")
    in_file.token_refused("10.0.0.9")
    told = [(one.who, one.act, one.what, one.client) for one in in_file.audit()]
    assert told == [
        ("boss", "account added", "ada, admin", "command line"),
        ("boss", "account added", "vic, viewer", "command line"),
        ("vic", "login", "", "10.0.0.7"),
        ("vic", "login refused", "", "10.0.0.8"),
        ("nobody", "token refused", "", "10.0.0.9"),
    ]
    assert in_file.verify_audit() == 5
    direct = sqlite3.connect(tmp_path / FILE)
    for text in ("UPDATE audit SET who = 'ada' WHERE seq = 2", "DELETE FROM audit WHERE seq = 2"):
        with pytest.raises(sqlite3.IntegrityError, match="only added to"):
            direct.execute(text)
    direct.execute("DROP TRIGGER audit_keeps")
    direct.execute("UPDATE audit SET who = 'ada' WHERE seq = 2")
    direct.commit()
    direct.close()
    with pytest.raises(InvalidBundle, match="entry 2"):
        in_file.verify_audit()


def test_a_flood_of_bad_tokens_does_not_fill_the_disk(in_file):
    before = len(in_file.audit())
    for _ in range(200):
        in_file.token_refused("10.0.0.9")
    assert len(in_file.audit()) - before < 10


def test_a_file_that_is_none_is_refused_by_name(tmp_path):
    (tmp_path / FILE).write_bytes(b"no database at all, but a text of some length" * 50)
    (tmp_path / FILE).chmod(0o600)
    with pytest.raises(InvalidBundle, match=FILE):
        Accounts(tmp_path / FILE)


def test_who_was_let_in_is_remembered_for_stop_while_the_file_is_gone(in_file, monkeypatch):
    login = in_file.log_in("vic", PASSWORD, "")
    assert in_file.remembered(login.secret) is None  # it was never shown since
    in_file.by_cookie(login.secret, "")

    def gone(*_):
        raise sqlite3.OperationalError("disk I/O error")

    monkeypatch.setattr(in_file._store, "key", gone)
    with pytest.raises(sqlite3.Error):
        in_file.by_cookie(login.secret, "")
    assert who(in_file.remembered(login.secret)) == ("vic", Role.VIEWER)
    assert in_file.remembered("something else") is None


class Door(RuleBasedStateMachine):
    """Whatever is done in whatever order: a key opens exactly while its account is there and it was not ended."""

    names = st.sampled_from(["ada", "ben", "cem"])

    def __init__(self):
        super().__init__()
        from tempfile import TemporaryDirectory

        self.folder = TemporaryDirectory()
        self.clock = Clock()
        self.accounts = Accounts(self.path, self.clock, QUICK)
        self.accounts.add("root", Role.ADMIN, PASSWORD, BOSS)
        self.roles: dict[str, Role] = {}
        self.logins: dict[str, tuple[str, float]] = {}
        self.ended: set[str] = set()

    @property
    def path(self):
        from pathlib import Path

        return Path(self.folder.name) / FILE

    @rule(name=names, role=st.sampled_from(Role))
    def add_or_change(self, name, role):
        if name in self.roles:
            self.accounts.set_role(name, role, BOSS)
        else:
            self.accounts.add(name, role, PASSWORD, BOSS)
        self.roles[name] = role

    @rule(name=names)
    def remove(self, name):
        if self.roles.pop(name, None) is None:
            with pytest.raises(NotFound):
                self.accounts.remove(name, BOSS)
        else:
            self.accounts.remove(name, BOSS)
            self._end(name)

    @rule(name=names)
    def log_in(self, name):
        if name in self.roles:
            login = self.accounts.log_in(name, PASSWORD, "")
            self.logins[login.secret] = (name, login.ends)

    @rule(name=names)
    def new_password(self, name):
        if name in self.roles:
            self.accounts.set_password(name, PASSWORD, BOSS)
            self._end(name)

    @rule(hours=st.integers(1, 13))
    def wait(self, hours):
        self.clock.now += 3600 * hours

    @rule()
    def start_again(self):
        self.accounts.close()
        self.accounts = Accounts(self.path, self.clock, QUICK)

    def _end(self, name):
        self.ended |= {secret for secret, (whose, _) in self.logins.items() if whose == name}

    @invariant()
    def keys_open_what_they_should(self):
        for secret, (name, ends) in self.logins.items():
            stands = secret not in self.ended and ends > self.clock.now
            assert who(self.accounts.by_cookie(secret, "")) == ((name, self.roles[name]) if stands else None)

    def teardown(self):
        assert self.accounts.verify_audit() > 0
        self.accounts.close()
        self.folder.cleanup()


TestDoor = Door.TestCase
TestDoor.settings = settings(max_examples=15, stateful_step_count=15, derandomize=True, deadline=None)


@given(gaps=st.lists(st.floats(0, 100), min_size=1, max_size=40), free=st.integers(1, 6))
def test_waits_grow_are_bounded_and_end(gaps, free):
    now = [0.0]
    throttle = Throttle(free, clock=lambda: now[0])
    tried = 0
    for gap in gaps:
        now[0] += gap
        wait = throttle.attempt("key")
        assert 0 <= wait <= LONGEST_WAIT
        assert (wait > 0) <= (tried >= free)
        tried += wait == 0
    assert throttle.attempt("another") == 0
    now[0] += LONGEST_WAIT + 1e-6
    assert throttle.attempt("key") == 0
