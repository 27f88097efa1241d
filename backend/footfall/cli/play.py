"""The command ``footfall play``: a recording of a rover, played into a server as that rover."""

import asyncio
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from footfall.cli import terminal
from footfall.cli.terminal import Json
from footfall.core.errors import InvalidInput

if TYPE_CHECKING:
    from footfall.sim.player import Played, Player


def run_play(
    recording: Annotated[Path, typer.Argument(help="MCAP file that a session recorded.")],
    url: Annotated[str, typer.Option(help="Rover link of the server.")] = "ws://127.0.0.1:8080/api/v1/rover",
    rate: Annotated[float, typer.Option(help="Times as fast as it was recorded, 0.1 to 100.")] = 1.0,
    start: Annotated[float, typer.Option("--from", help="Where to begin, seconds from its beginning.", min=0.0)] = 0.0,
    control: Annotated[
        bool, typer.Option("--control", help="Read lines from stdin: pause, go, seek SECONDS, rate FACTOR.")
    ] = False,
    certificate: Annotated[Path | None, typer.Option(help="PEM file of the server's own certificate.")] = None,
    as_json: Json = False,
) -> None:
    """Play a recording into a server, as the rover that it is of; commands are refused, a stop pauses it.

    FOOTFALL_ROVER_TOKEN is its token, where the server has accounts.
    """
    from footfall.io.recordings.reading import Recording
    from footfall.sim.door import door_options
    from footfall.sim.player import Playback, Player

    read = Recording(recording)
    if start > read.duration:
        raise InvalidInput(f"{recording.name} lasts {read.duration:z.1f} s; --from {start:g} is behind its end")
    played = asyncio.run(_play(Player(url, read, Playback(rate, start), door_options(url, certificate)), control))
    if as_json:
        terminal.show({"played": played, "recorded": read.counts})
    else:
        typer.echo(f"{played.frames} frames and {played.images} sets of images of {read.robot} played")


async def _play(player: "Player", control: bool) -> "Played":
    if control:
        loop = asyncio.get_running_loop()
        threading.Thread(target=_read_lines, args=(player, loop), daemon=True).start()
    return await player.run()


def _read_lines(player: "Player", loop: asyncio.AbstractEventLoop) -> None:
    for line in sys.stdin:
        if loop.is_closed():
            return
        loop.call_soon_threadsafe(_obey, player, line)


def _obey(player: "Player", line: str) -> None:
    try:
        player.control(line)
    except InvalidInput as error:
        typer.echo(f"footfall: {error.message}", err=True)
