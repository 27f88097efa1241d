"""The command line. Exit codes: 0 done, 1 "no" as an answer, 2 misuse.

Results go to stdout, progress and errors to stderr; with ``--json`` stdout holds exactly one JSON document.
"""

import io
import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from footfall.cli import terminal
from footfall.cli.accounts import accounts_app
from footfall.cli.maps import make_map
from footfall.cli.plan_gait import plan_gait as run_plan_gait
from footfall.cli.plan_route import plan_route as run_plan_route
from footfall.cli.plan_step import plan_step as run_plan_step
from footfall.cli.plan_walk import WithGoal
from footfall.cli.plan_walk import plan_walk as run_plan_walk
from footfall.cli.play import run_play
from footfall.cli.referee import run_referee
from footfall.cli.robot import robot_app
from footfall.cli.serve import serve, worker
from footfall.cli.sessions import DEFAULT_DATA, Data, sessions_app
from footfall.cli.terminal import (
    AtX,
    AtY,
    AtYaw,
    Json,
    Reporting,
    RobotName,
    bar,
    say,
)
from footfall.cli.terrain import terrain_app
from footfall.cli.view import view_walk
from footfall.core.errors import InvalidInput, NotFound
from footfall.core.value import SOFTWARE_VERSION

app = typer.Typer(
    cls=Reporting,
    rich_markup_mode=None,
    no_args_is_help=True,
    add_completion=False,
    help="A ground tool for walking rovers.",
)
plan_app = typer.Typer(cls=Reporting, rich_markup_mode=None, no_args_is_help=True, help="Plan what the rover is to do.")
app.add_typer(accounts_app, name="accounts")
app.add_typer(terrain_app, name="terrain")
app.add_typer(plan_app, name="plan")
app.add_typer(robot_app, name="robot")
app.add_typer(sessions_app, name="sessions")
plan_app.command("step")(run_plan_step)
plan_app.command("gait", cls=WithGoal)(run_plan_gait)
plan_app.command("walk", cls=WithGoal)(run_plan_walk)
plan_app.command("route")(run_plan_route)
app.command("serve")(serve)
app.command("worker")(worker)
app.command("map")(make_map)
app.command("referee")(run_referee)
app.command("play")(run_play)
app.command("view")(view_walk)


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # a name that the terminal can't show is spelled out; it must not end the work
            stream.reconfigure(errors="backslashreplace")
    app()


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context, version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False
) -> None:
    """A ground tool for walking rovers."""
    if version:
        typer.echo(f"footfall {SOFTWARE_VERSION}")
        raise typer.Exit


@app.command()
def replay(
    bundles: Annotated[
        list[Path], typer.Argument(help="Session folders or zips; recordings (.mcap).", metavar="BUNDLE…")
    ],
    check: Annotated[bool, typer.Option("--check/--no-check", help="Recompute and compare every product.")] = True,
    as_json: Json = False,
) -> None:
    """Recompute what sessions recorded; read recordings of rovers anew. Exit code 1 where that is not as it was."""
    from footfall.io.recordings import SUFFIX, UNFINISHED
    from footfall.session.replay.recompute import ReplayReport
    from footfall.session.replay.recompute import replay as run
    from footfall.session.replay.recordings import RecordingReport, replay_recording

    reports: dict[str, ReplayReport | RecordingReport] = {}
    missing = [str(path) for path in bundles if not path.exists()]
    if missing:
        raise NotFound(f"there is no session at {', '.join(missing)}")
    for path in bundles:
        with bar(f"replay {path.name}") as progress:
            if path.is_file() and path.name.endswith((SUFFIX, UNFINISHED)):
                report = replay_recording(path, progress)
            else:
                report = run(path, check=check, progress=progress)
        reports[str(path)] = report
        for line in (*report.lines(), f"{path}: {report.summary()}"):
            say(line, as_json)
    ok = all(report.ok for report in reports.values())
    if as_json:
        of_bundles = {path: one.as_dict() for path, one in reports.items() if isinstance(one, ReplayReport)}
        of_recordings = {path: one.as_dict() for path, one in reports.items() if isinstance(one, RecordingReport)}
        terminal.show({"ok": ok, "bundles": of_bundles, "recordings": of_recordings})
    raise typer.Exit(0 if ok else 1)


@app.command()
def export(
    context: typer.Context,
    source: Annotated[Path, typer.Argument(help="Session folder or zip, or the .npz of `footfall plan step --out`.")],
    format: Annotated[
        str, typer.Option("--format", help="json, csv, seqjson, fprime, fprime-dictionary, yamcs, ros2 or html.")
    ] = "seqjson",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File to write; otherwise stdout.", callback=terminal.writable)
    ] = None,
    page: Annotated[bool, typer.Option("--page", help="The whole session as a page that plays alone.")] = False,
    robot: Annotated[Path | None, typer.Option(help="Its robot.toml, for a plan of a robot of your own.")] = None,
    terrain: Annotated[Path | None, typer.Option(help="The terrain that such a plan was made on.")] = None,
    as_json: Json = False,
) -> None:
    """Write a session's sequence, or the commands of a plan, as a file for others; or a whole session as a page."""
    if page:
        terminal.refuse_typed(
            context, ("format", "robot", "terrain"), "can't go with --page, which is all of a session"
        )
        _export_page(source, out, as_json)
        return
    from footfall.cli.recorded import sequence_of
    from footfall.io.exports import export as run

    if source.suffix != ".npz":
        terminal.refuse_typed(context, ("robot", "terrain"), "are for plans: a session has its own")
    sequence = sequence_of(source, robot, terrain)
    content = run(sequence, format, out)
    if as_json:
        terminal.show({"sequence": sequence.digest, "commands": len(sequence.commands), "bytes": len(content)})
    elif out is None:
        typer.echo(content, nl=False)
    else:
        typer.echo(f"{len(sequence.commands)} commands written to {out}")


def _export_page(source: Path, out: Path | None, as_json: bool) -> None:
    from footfall.api.bodies.jsonable import jsonable
    from footfall.cli.recorded import RecordedSession
    from footfall.io.session_page import encode
    from footfall.io.whole_files import write_whole
    from footfall.session.replay.page_story import page_story

    recorded = RecordedSession(source)
    content = encode(jsonable(page_story(recorded.events, recorded.typed, recorded.robot())))
    if out is not None:
        write_whole(out, content)
    if as_json:
        terminal.show({"events": len(recorded.events), "bytes": len(content)})
    elif out is None:
        typer.echo(content, nl=False)
    else:
        typer.echo(f"{len(recorded.events)} events written to {out}")


@app.command()
def sim(
    context: typer.Context,
    terrain: Annotated[Path, typer.Argument(help="Terrain file that is the rover's world.")],
    url: Annotated[str, typer.Option(help="Rover link of the server.")] = "ws://127.0.0.1:8080/api/v1/rover",
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    seed: Annotated[int, typer.Option(help="Seed of the cameras' noise.")] = 0,
    physics: Annotated[
        bool | None,
        typer.Option(
            "--physics/--kinematic",
            help="Masses, springs and contact, or joints that go as told; a robot of your own is kinematic.",
            show_default="physics",
        ),
    ] = None,
    gravity: Annotated[str, typer.Option(help="Of the world in physics: earth, moon or mars.")] = "earth",
    certificate: Annotated[Path | None, typer.Option(help="PEM file of the server's own certificate.")] = None,
    robot: RobotName = "athlete",
) -> None:
    """Run a simulated rover on the link of a server until Ctrl-C; FOOTFALL_ROVER_TOKEN is its token."""
    from footfall.balance.balance_settings import gravity_named
    from footfall.io.any_robot import is_legged
    from footfall.sim.physics.physics_settings import PhysicsSettings
    from footfall.sim.process import Start, run_rover

    in_physics = not is_legged(robot) if physics is None else physics
    if not in_physics:
        terminal.refuse_typed(context, ["gravity"], "is of the world in physics, and this rover is kinematic")
    world = PhysicsSettings(gravity=gravity_named(gravity), seed=seed) if in_physics else None
    run_rover(url, terrain, robot, seed, start=Start(x, y, yaw), physics=world, certificate=certificate)


@app.command()
def bench(
    areas: Annotated[list[str] | None, typer.Argument(help="Areas to measure; all when none is named.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer repetitions.")] = False,
    as_json: Json = False,
) -> None:
    """Measure how fast this machine does the work; exit code 1 where a floor does not hold."""
    try:
        run = import_module("benchmarks.run")
    except ModuleNotFoundError as error:
        if error.name not in ("benchmarks", "benchmarks.run"):
            raise
        text = "the benchmarks are in the source tree only (folder benchmarks/); run this from a checkout after `make`"
        raise NotFound(text) from None
    unknown = [area for area in areas or [] if area not in run.AREAS]
    if unknown:
        raise InvalidInput(f"there is no benchmark area {', '.join(unknown)}; there are {', '.join(run.AREAS)}")
    raise typer.Exit(run.main(areas, quick=quick, as_json=as_json))


@app.command("compile")
def compile_kernels() -> None:
    """Compile the numeric kernels now; otherwise whoever uses them first waits for it."""
    from footfall.compiling import compile_kernels as run

    with bar("compiling") as progress:
        run(progress)


@app.command()
def doctor(
    data: Data = DEFAULT_DATA,
    store: Annotated[
        str | None,
        typer.Option(
            help="Look at this PostgreSQL database; otherwise at the one that the data folder names, if any.",
            envvar="FOOTFALL_STORE",
            metavar="postgresql://USER@HOST/DATABASE",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Check that everything FootFall needs is here; exit code 1 where something is missing."""
    from footfall.cli.doctor import examine

    findings = examine(data.expanduser(), store)
    if as_json:
        terminal.show({"ok": all(one.ok for one in findings), "findings": findings})
    else:
        for one in findings:
            typer.echo(f"{'ok  ' if one.ok else 'FAIL'}  {one.what:<24} {one.text}")
    raise typer.Exit(0 if all(one.ok for one in findings) else 1)
