"""The commands ``footfall accounts …``: who may come in, with which role, and what was done."""

import getpass
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from footfall.cli import terminal
from footfall.cli.terminal import Json, Reporting, say
from footfall.core.errors import InvalidInput
from footfall.session.access.identity import Identity, Role

if TYPE_CHECKING:
    from footfall.session.access.accounts import Accounts

accounts_app = typer.Typer(
    cls=Reporting, rich_markup_mode=None, no_args_is_help=True, help="Who may come in, and what they may do."
)
token_app = typer.Typer(
    cls=Reporting, rich_markup_mode=None, no_args_is_help=True, help="Tokens of programs and rovers."
)
accounts_app.add_typer(token_app, name="token")

Data = Annotated[Path, typer.Option("--data", help="Folder of the sessions.", envvar="FOOTFALL_DATA")]
DEFAULT_DATA = Path("~/.local/share/footfall")
Name = Annotated[str, typer.Argument(help="Of the account.")]
TokenName = Annotated[str, typer.Argument(help="Of the token.")]
RoleName = Annotated[Role, typer.Argument(help="viewer, planner, commander or admin.")]


@accounts_app.command("add")
def add(
    name: Name,
    role: Annotated[Role, typer.Option(help="viewer, planner, commander or admin.")] = Role.VIEWER,
    data: Data = DEFAULT_DATA,
) -> None:
    """Make an account; the password is asked for, or read from stdin."""
    with _accounts(data) as accounts:
        first = not accounts.everyone()
        accounts.add(name, role, _password(), _me())
    typer.echo(f"{name} is {role.value}")
    if first:
        typer.echo("the first account: a server that runs asks for accounts from its next start on", err=True)


@accounts_app.command("list")
def show(data: Data = DEFAULT_DATA, as_json: Json = False) -> None:
    """List the accounts."""
    with _accounts(data) as accounts:
        found = accounts.everyone()
    if as_json:
        terminal.show([{"name": one.name, "role": one.role, "created": one.created} for one in found])
    for one in found:
        say(f"{one.name:<32}  {one.role:<10} since {_day(one.created)}", as_json)


@accounts_app.command("password")
def password(name: Name, data: Data = DEFAULT_DATA) -> None:
    """Give an account another password, asked for or read from stdin; its logins end."""
    with _accounts(data) as accounts:
        accounts.set_password(name, _password(), _me())
    typer.echo(f"{name} has another password, and is logged out everywhere")


@accounts_app.command("role")
def role(name: Name, role: RoleName, data: Data = DEFAULT_DATA) -> None:
    """Give an account another role, from now on."""
    with _accounts(data) as accounts:
        accounts.set_role(name, role, _me())
    typer.echo(f"{name} is {role.value}")


@accounts_app.command("remove")
def remove(name: Name, data: Data = DEFAULT_DATA) -> None:
    """Remove an account; its logins and tokens end at once."""
    with _accounts(data) as accounts:
        accounts.remove(name, _me())
    typer.echo(f"{name} is removed")


@accounts_app.command("audit")
def audit(
    after: Annotated[int, typer.Option(help="Entries after this number.")] = -1,
    data: Data = DEFAULT_DATA,
    as_json: Json = False,
) -> None:
    """Show who did what, when and from where; refused where an entry was changed or lost."""
    with _accounts(data) as accounts:
        accounts.verify_audit()
        found = [one for one in accounts.audit(limit=sys.maxsize) if one.seq > after]
    if as_json:
        names = ("seq", "time", "who", "act", "what", "client")
        terminal.show([{name: getattr(one, name) for name in names} for one in found])
    for one in found:
        time = datetime.fromtimestamp(one.time, UTC).strftime("%Y-%m-%d %H:%M:%S")
        say(f"{one.seq:>5}  {time}Z  {one.who} from {one.client or '?'}: {one.act} {one.what}".rstrip(), as_json)


@token_app.command("add")
def add_token(
    name: TokenName,
    account: Annotated[str | None, typer.Option(help="Whose token it is.")] = None,
    rover: Annotated[bool, typer.Option("--rover", help="For a rover: it opens the rover link alone.")] = False,
    role: Annotated[Role | None, typer.Option(help="The most that it may do; otherwise what its account may.")] = None,
    days: Annotated[float, typer.Option(help="How long it lasts.")] = 90.0,
    data: Data = DEFAULT_DATA,
) -> None:
    """Make a token and show it, this once; send it as `Authorization: Bearer …`."""
    if rover == (account is not None):
        raise InvalidInput("a token is either of an account (--account NAME) or of a rover (--rover)")
    with _accounts(data) as accounts:
        text = accounts.add_token(name, account, _me(), role, days)
    typer.echo(text)
    typer.echo(f"token {name}, for {days:g} days; it is not shown again", err=True)


@token_app.command("list")
def show_tokens(data: Data = DEFAULT_DATA, as_json: Json = False) -> None:
    """List the tokens; what they are is known to their owners alone."""
    with _accounts(data) as accounts:
        found = accounts.tokens()
    if as_json:
        names = ("name", "account", "role", "created", "expires")
        terminal.show([{name: getattr(one, name) for name in names} for one in found])
    now = datetime.now(UTC).timestamp()
    for one in found:
        whose = "rover" if one.account is None else one.account + (f", at most {one.role}" if one.role else "")
        ends = f"ends {_day(one.expires)}" if one.expires > now else f"ENDED {_day(one.expires)}"
        say(f"{one.name or '':<32}  {whose:<32} {ends}", as_json)


@token_app.command("revoke")
def revoke_token(name: TokenName, data: Data = DEFAULT_DATA) -> None:
    """Revoke a token; it opens nothing from now on."""
    with _accounts(data) as accounts:
        accounts.revoke_token(name, _me())
    typer.echo(f"token {name} is revoked")


@contextmanager
def _accounts(data: Path) -> "Iterator[Accounts]":
    from footfall.session.access.account_stores import account_store
    from footfall.session.access.accounts import Accounts

    with closing(Accounts(account_store(data.expanduser()))) as accounts:
        yield accounts


def _me() -> Identity:
    return Identity(getpass.getuser(), Role.ADMIN, "command line")


def _password() -> str:
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    first = getpass.getpass("Password: ")
    if getpass.getpass("Once more: ") != first:
        raise InvalidInput("the two passwords differ; nothing was changed")
    return first


def _day(time: float) -> str:
    return datetime.fromtimestamp(time, UTC).strftime("%Y-%m-%d")
