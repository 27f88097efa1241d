"""Accounts on a database server: one set for several servers, heard of in time, and never waited for."""

import json
import threading
import time
from contextlib import closing

import psycopg
import pytest

from footfall.core.errors import Conflict
from footfall.io.account_store import FILE
from footfall.session.access import shared_accounts
from footfall.session.access.account_stores import MOVED, account_store, has_accounts
from footfall.session.access.accounts import Accounts, AccountsUnreadable
from footfall.session.access.identity import Role
from footfall.session.access.shared_accounts import UNHEARD, SharedAccounts
from footfall.session.storage.databases import bind, binding
from footfall.session.storage.interface import StoreRefused
from footfall.session.storage.verify import verify
from tests.session.test_accounts import BOSS, PASSWORD, QUICK, who
from tests.support.waiting import a_while, until


@pytest.fixture(autouse=True)
def _soon(monkeypatch):
    monkeypatch.setattr(shared_accounts, "LOOK_AGAIN", 0.1)


@pytest.fixture
def folder(postgres, tmp_path):
    bind(tmp_path, postgres.fresh())
    return tmp_path


@pytest.fixture
def url(folder):
    found = binding(folder)
    assert found is not None
    return found.url


@pytest.fixture
def first(folder):
    """As one server has them open."""
    with closing(Accounts(account_store(folder), hasher=QUICK)) as made:
        made.add("ada", Role.ADMIN, PASSWORD, BOSS)
        yield made


@pytest.fixture
def second(folder, first):
    with closing(Accounts(account_store(folder), hasher=QUICK)) as made:
        yield made


def test_what_one_server_changes_the_other_hears_of_by_itself(first, second):
    login = first.log_in("ada", PASSWORD, "")
    assert who(first.by_cookie(login.secret, "")) == ("ada", Role.ADMIN)
    until(lambda: second.by_cookie(login.secret, ""), "the login at the other server")
    token = second.add_token("script", "ada", BOSS, Role.VIEWER)
    assert who(second.by_token(token, "")) == ("ada", Role.VIEWER)
    until(lambda: first.by_token(token, ""), "the token at the other server")
    second.revoke_token("script", BOSS)
    assert second.by_token(token, "") is None
    until(lambda: first.by_token(token, "") is None, "its end at the other server")


def test_of_changes_at_once_none_is_lost_and_the_record_is_whole(first, second):
    def add(accounts, who):
        for i in range(10):
            accounts.add(f"{who}{i}", Role.VIEWER, PASSWORD, BOSS)

    threads = [threading.Thread(target=add, args=args) for args in ((first, "a"), (second, "b"), (first, "c"))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(second.everyone()) == 31
    assert second.verify_audit() == 31


def test_the_record_is_only_added_to(folder, url, first):
    assert verify(folder) == []
    with closing(psycopg.connect(url, autocommit=True)) as direct:
        for text in ("UPDATE audit SET who = 'eve'", "DELETE FROM audit", "TRUNCATE audit"):
            with pytest.raises(psycopg.IntegrityError, match="only added to"):
                direct.execute(text.encode())
        direct.execute("ALTER TABLE audit DISABLE TRIGGER audit_stays")
        assert [(one.kind, one.harmful) for one in verify(folder)] == [("database", True)]


def test_a_lost_connection_is_made_again(url, first):
    with closing(psycopg.connect(url, autocommit=True)) as server:
        server.execute("SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity WHERE pid <> pg_backend_pid()")
    first.add("vic", Role.VIEWER, PASSWORD, BOSS)
    assert [one.name for one in first.everyone()] == ["ada", "vic"]


def test_a_server_that_is_gone_recognises_nobody_new_and_nobody_waits(postgres, first, monkeypatch):
    login = first.log_in("ada", PASSWORD, "")
    assert first.by_cookie(login.secret, "") is not None
    postgres.stop("immediate")
    try:
        with pytest.raises(AccountsUnreadable):
            first.add("vic", Role.VIEWER, PASSWORD, BOSS)
        now = time.monotonic() + UNHEARD
        monkeypatch.setattr(first._store, "_clock", lambda: now + 0.1)
        with pytest.raises(StoreRefused, match="accounts could not be looked at"):
            first.by_cookie(login.secret, "")
        assert who(first.remembered(login.secret)) == ("ada", Role.ADMIN)
    finally:
        postgres.start()
    until(lambda: opens(first, login), "the server again")


def test_keys_stay_good_while_nobody_asks(first, monkeypatch):
    """A server takes its time until it answers the first request."""
    login = first.log_in("ada", PASSWORD, "")
    monkeypatch.setattr(shared_accounts, "UNHEARD", 0.5)
    a_while(1.0)
    until(lambda: opens(first, login), "the login")


def opens(accounts, login):
    try:
        return accounts.by_cookie(login.secret, "")
    except StoreRefused:
        return None


def test_accounts_of_a_file_are_carried_over_once(postgres, tmp_path):
    with closing(Accounts(account_store(tmp_path), hasher=QUICK)) as before:
        before.add("ada", Role.ADMIN, PASSWORD, BOSS)
        token = before.add_token("gateway", None, BOSS)
        login = before.log_in("ada", PASSWORD, "10.0.0.7")
        told = before.audit()
    bind(tmp_path, postgres.fresh())
    with closing(Accounts(account_store(tmp_path), hasher=QUICK)) as after:
        assert after.audit() == told
        assert after.verify_audit() == 3
        assert who(after.by_cookie(login.secret, "")) == ("ada", Role.ADMIN)
        opened = after.by_token(token, "")
        assert opened is not None
        assert opened.rover == "gateway"
        after.log_in("ada", PASSWORD, "")
    assert {path.name for path in tmp_path.iterdir() if path.name.startswith(FILE)} == {MOVED}
    (tmp_path / MOVED).rename(tmp_path / FILE)
    with pytest.raises(Conflict, match="move that file away"):
        account_store(tmp_path)


def test_a_folder_bound_to_a_server_asks_there(folder):
    assert has_accounts(folder)
    with closing(account_store(folder)) as store:
        assert isinstance(store, SharedAccounts)
        assert store.accounts() == []
    assert not (folder / FILE).exists()
    assert json.loads((folder / "store").read_text())["url"].startswith("postgresql://")
