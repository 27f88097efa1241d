"""Where the accounts of a data folder are kept: with its sessions, in a file of the folder or on a database server."""

import os
import sys
from contextlib import closing
from pathlib import Path

from footfall.core.errors import Conflict
from footfall.io.account_store import FILE, AccountFile, AccountStore
from footfall.logs import FOLDER as LOGS
from footfall.session.storage.databases import binding, require_extra
from footfall.session.storage.sqlite_log import DATABASE

MOVED = f"{FILE}.moved"


def account_store(folder: Path) -> AccountStore:
    """The accounts of a data folder, made where there are none; the caller's to close.

    Those that are in a file, of a folder that is bound to a server since, are carried over once. Raises Conflict where
    there are accounts in both.
    """
    bound = binding(folder)
    if bound is None:
        return AccountFile(folder / FILE)
    require_extra(bound.url)
    from footfall.session.access.shared_accounts import SharedAccounts

    shared = SharedAccounts(bound.url, bound.id)
    try:
        if (folder / FILE).exists():
            with closing(AccountFile(folder / FILE)) as file:
                carry_over(file, shared)
            os.replace(folder / FILE, folder / MOVED)
    except BaseException:
        shared.close()
        raise
    return shared


def keep_to_owner(folder: Path) -> None:
    """Let nobody but the owner read the logs of a folder with accounts, of sessions and of the program, nor what this
    process makes from now on."""
    os.umask(0o077)
    # the program's own log is begun before accounts are looked at
    for path in (*folder.glob(f"{DATABASE}*"), *folder.glob(f"{LOGS}/*")):
        path.chmod(0o600)


def has_accounts(folder: Path) -> bool:
    """Whether it may have some: to look for them makes nothing."""
    return binding(folder) is not None or (folder / FILE).exists()


def carry_over(file: AccountFile, shared: AccountStore) -> None:
    """Put what a file holds, the record too, where there are no accounts yet; all or nothing. Raises Conflict."""
    file.verify_audit()
    with shared.change() as change:
        if change.accounts():
            raise Conflict(
                f"there are accounts in the database and in {file.path}; the database counts: move that file away",
                path=str(file.path),
            )
        for account in file.accounts():
            change.put_account(account)
        for key in file.every_key():
            change.put_key(key)
        for entry in file.audit(limit=sys.maxsize):
            change.note(entry.time, entry.who, entry.act, entry.what, entry.client)
