"""The commands ``footfall serve`` and ``footfall worker``."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from footfall.cli import terminal
from footfall.cli.legged import SERVED, served_robot
from footfall.cli.sessions import DEFAULT_DATA, Data
from footfall.cli.terminal import RobotName
from footfall.core.collector import none_while_loading
from footfall.core.errors import InvalidInput


def serve(
    context: typer.Context,
    host: Annotated[
        str, typer.Option(help="Name or address to listen on; others than loopback need accounts and TLS.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 takes a free one.")] = 8080,
    sample: Annotated[str, typer.Option(help="Sample session to open a copy of.")] = "rock-step",
    session: Annotated[str | None, typer.Option(help="Open this session of the data folder instead.")] = None,
    data: Data = DEFAULT_DATA,
    store: Annotated[
        str | None,
        typer.Option(
            help="Keep the logs in this PostgreSQL database from now on; otherwise where the data folder has them.",
            envvar="FOOTFALL_STORE",
            metavar="postgresql://USER@HOST/DATABASE",
        ),
    ] = None,
    workers: Annotated[int, typer.Option(help="How many jobs at a time on this machine.", min=1, max=64)] = 2,
    worker_beside: Annotated[
        bool, typer.Option("--worker/--no-worker", help="With PostgreSQL: do jobs on this machine too.")
    ] = True,
    sim: Annotated[bool, typer.Option("--sim/--no-sim", help="Run a simulated rover.")] = True,
    seed: Annotated[int, typer.Option(help="Seed of the simulated cameras' noise.")] = 0,
    physics: Annotated[
        bool, typer.Option("--physics/--kinematic", help="Whether that rover has masses, springs and contact.")
    ] = True,
    accounts: Annotated[
        bool,
        typer.Option("--accounts", help="Refuse to start without accounts; where there are some, they count anyway."),
    ] = False,
    tls_cert: Annotated[Path | None, typer.Option(help="Certificate, PEM, with those that vouch for it.")] = None,
    tls_key: Annotated[Path | None, typer.Option(help="Its private key, PEM.")] = None,
    behind_tls_proxy: Annotated[
        bool, typer.Option("--behind-tls-proxy", help="A proxy in front ends TLS and says who asks.")
    ] = False,
    public_url: Annotated[
        str | None, typer.Option(help="As browsers elsewhere name this server: https://ground.example.")
    ] = None,
    telemetry_delay: Annotated[
        float, typer.Option(help="Light time from the rover, made by this server [s]; the Moon: 1.28.")
    ] = 0.0,
    command_delay: Annotated[float, typer.Option(help="Light time to the rover, stops included [s].")] = 0.0,
    foxglove: Annotated[
        int | None,
        typer.Option(
            help="Show it live in Foxglove, on this port of loopback (Foxglove looks at 8765).",
            min=0,
            max=65535,
            metavar="PORT",
        ),
    ] = None,
    policy: Annotated[
        Path | None,
        typer.Option(
            help="Learned table that a walk by itself may choose gaits by, of training.gait_policy.",
            exists=True,
            dir_okay=False,
        ),
    ] = None,
    robot: RobotName = SERVED,
    terrain: Annotated[
        Path | None, typer.Option(help="Ground of a robot of your own: a new session is about both.")
    ] = None,
) -> None:
    """Serve the operator's page, the REST interface and a simulated rover until Ctrl-C."""
    if session is not None and robot != SERVED:
        raise InvalidInput("a session has its own robot: leave out --session or --robot")
    described = served_robot(robot, terrain, sim)
    if session is not None or described is not None:
        terminal.refuse_typed(context, ["sample"], "opens a copy of a sample; leave it out, or --session and --robot")
    if described is not None and physics:
        terminal.refuse_typed(context, ["physics"], "is for ATHLETE: the rover of a robot of your own is kinematic")
    with none_while_loading():
        from footfall.logs import start_logging
        from footfall.session.rover.light_time import LightTime
        from footfall.session.storage.databases import bind
        from footfall_ui.app import serve as run
        from footfall_ui.listening import Tls

    light_time, folder = LightTime(telemetry=telemetry_delay, commands=command_delay), data.expanduser()
    start_logging(folder)
    if store is not None:
        bind(folder, store)

    def ready(url: str) -> None:
        # at once, also into a pipe: scripts wait for this line
        typer.echo(f"FootFall answers on {url}")
        if foxglove:
            from footfall.session.access.account_stores import has_accounts

            login = "; it asks for no login: whoever is on this machine may look" if has_accounts(folder) else ""
            typer.echo(f"Foxglove may connect to ws://127.0.0.1:{foxglove}{login}")
        sys.stdout.flush()

    run(
        host,
        port,
        sample=sample,
        session=session,
        folder=folder,
        sim=sim,
        seed=seed,
        physics=physics,
        on_ready=ready,
        accounts=accounts,
        tls=Tls.of(tls_cert, tls_key),
        behind_tls_proxy=behind_tls_proxy,
        public_url=public_url,
        light_time=light_time,
        foxglove=foxglove,
        workers=workers,
        worker_beside=worker_beside,
        policy=policy,
        described=described,
    )


def worker(
    data: Data = DEFAULT_DATA,
    workers: Annotated[int, typer.Option(help="How many jobs at a time.", min=1, max=64)] = 2,
) -> None:
    """Do the work of servers whose sessions are in PostgreSQL, on this machine, until Ctrl-C.

    The data folder is the one that the servers use: it names the database.
    """
    from footfall.logs import start_logging
    from footfall.session.remote.worker_service import serve_jobs

    start_logging(None)
    serve_jobs(data.expanduser(), workers, on_ready=lambda: typer.echo("waiting for work"))
