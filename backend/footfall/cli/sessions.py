"""The commands ``footfall sessions …``: what sessions there are, copies of them, whether they are whole, tidying up."""

import time
from pathlib import Path
from typing import Annotated

import typer

from footfall.cli import terminal
from footfall.cli.terminal import Json, Reporting, bar, say

sessions_app = typer.Typer(
    cls=Reporting,
    rich_markup_mode=None,
    invoke_without_command=True,
    help="List the sessions of the data folder and the samples; back up, verify, prune.",
)

Data = Annotated[Path, typer.Option("--data", help="Folder of the sessions.", envvar="FOOTFALL_DATA")]
DEFAULT_DATA = Path("~/.local/share/footfall")
Named = Annotated[
    list[str] | None, typer.Argument(help="Sessions by id; all when none is named.", metavar="[SESSION]…")
]

DAY = 86_400.0


@sessions_app.callback()
def list_sessions(context: typer.Context, data: Data = DEFAULT_DATA, as_json: Json = False) -> None:
    """List the sessions of the data folder and the samples; back up, verify, prune."""
    if context.invoked_subcommand is not None:
        return
    from footfall.session.registry import Sessions

    with Sessions(data.expanduser()) as registry:
        found, samples = registry.list(), registry.samples()
    if as_json:
        terminal.show({"sessions": found, "samples": samples})
        return
    for one in found:
        events = one.get("problem") or f"{one['events']} events"
        typer.echo(f"{one['id']}  {one['name']}  {one['robot']}  {events}")
    typer.echo(f"samples: {', '.join(samples) or 'none'}")


@sessions_app.command("backup")
def run_backup(
    to: Annotated[Path, typer.Option("--to", help="New folder for the copy.")],
    sessions: Named = None,
    recordings: Annotated[
        bool, typer.Option("--recordings/--no-recordings", help="Whether recordings of the rover go along.")
    ] = True,
    data: Data = DEFAULT_DATA,
    as_json: Json = False,
) -> None:
    """Copy sessions while they are in use, and verify the copy; exit code 1 where it is not whole.

    The copy is a data folder itself: `footfall serve --data FOLDER` opens it.
    """
    from footfall.session.storage.backup import backup

    with bar("backup") as progress:
        findings = backup(data.expanduser(), to, sessions or (), recordings, progress)
    whole = not any(one.harmful for one in findings)
    if as_json:
        terminal.show({"ok": whole, "folder": str(to), "findings": findings})
    for one in findings:
        say(_line(one.harmful, one.session, one.text), as_json)
    say(f"copied to {to}; the copy is {'whole' if whole else 'NOT whole'}", as_json)
    raise typer.Exit(0 if whole else 1)


@sessions_app.command("verify")
def run_verify(sessions: Named = None, data: Data = DEFAULT_DATA, as_json: Json = False) -> None:
    """Check logs, heads and artifacts, also of sessions in use; exit code 1 where something is lost or in danger."""
    from footfall.session.storage.verify import verify

    with bar("verify") as progress:
        findings = verify(data.expanduser(), sessions or (), progress)
    whole = not any(one.harmful for one in findings)
    if as_json:
        terminal.show({"ok": whole, "findings": findings})
    for one in findings:
        say(_line(one.harmful, one.session, one.text), as_json)
    say("whole" if whole else "NOT whole", as_json)
    raise typer.Exit(0 if whole else 1)


@sessions_app.command("prune")
def run_prune(
    sessions: Named = None,
    recordings_older: Annotated[
        float | None, typer.Option("--recordings-older-than", help="Also recordings older than so many days.", min=0.0)
    ] = None,
    sessions_older: Annotated[
        float | None,
        typer.Option("--sessions-older-than", help="Also whole sessions with no event for so many days.", min=0.0),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Remove it; otherwise only say what would go.")] = False,
    data: Data = DEFAULT_DATA,
    as_json: Json = False,
) -> None:
    """Remove what nothing refers to from sessions that nobody has open; without --yes only say what would go."""
    from footfall.session.storage.prune import prune

    now = time.time()
    pruned = prune(
        data.expanduser(),
        sessions or (),
        None if recordings_older is None else now - recordings_older * DAY,
        None if sessions_older is None else now - sessions_older * DAY,
        carry_out=yes,
    )
    total = sum(one.bytes for one in pruned.removals)
    if as_json:
        terminal.show({"removed": yes, "bytes": total, "removals": pruned.removals, "spared": pruned.spared})
        return
    for one in pruned.removals:
        typer.echo(f"{one.path}  {one.bytes} bytes  {one.why}")
    for session, why in pruned.spared.items():
        typer.echo(f"{session}: left alone: {why}")
    done = "removed" if yes else "would go; --yes removes them" if pruned.removals else "would go"
    typer.echo(f"{len(pruned.removals)} things, {total / 1e6:z.1f} MB, {done}")


def _line(harmful: bool, session: str, text: str) -> str:
    return f"{'BAD ' if harmful else 'note'}  {session or 'database'}: {text}"
