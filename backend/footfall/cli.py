"""The command line. Exit codes: 0 done, 1 "no" as an answer, 2 misuse.

Results go to stdout, progress and errors to stderr; with ``--json`` stdout holds exactly one JSON document.
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from footfall import terminal
from footfall.core.errors import InvalidInput, NotFound
from footfall.core.value import SOFTWARE_VERSION
from footfall.terminal import Json, Reporting, bar, say

app = typer.Typer(cls=Reporting, no_args_is_help=True, add_completion=False, help="A ground tool for walking rovers.")
terrain_app = typer.Typer(cls=Reporting, no_args_is_help=True, help="Terrain from images or files.")
plan_app = typer.Typer(cls=Reporting, no_args_is_help=True, help="Plan what the rover is to do.")
app.add_typer(terrain_app, name="terrain")
app.add_typer(plan_app, name="plan")

Data = Annotated[Path, typer.Option("--data", help="Folder of the sessions.", envvar="FOOTFALL_DATA")]
DEFAULT_DATA = Path("~/.local/share/footfall")
RobotName = Annotated[str, typer.Option("--robot", help="Name of a robot, or path of a description.")]
Pair = tuple[float, float]
AtX = Annotated[float, typer.Option("--x", help="Where the rover stands [m].")]
AtY = Annotated[float, typer.Option("--y", help="Where the rover stands [m].")]
AtYaw = Annotated[float, typer.Option("--yaw", help="Its heading [rad].")]
LegNumber = Annotated[int, typer.Option("--leg", help="Which leg, 0….")]
Conservative = Annotated[bool, typer.Option("--conservative", help="Balance must survive the loss of any one leg.")]


def main() -> None:
    """Entry point of the console script."""
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
def serve(
    host: Annotated[str, typer.Option(help="Loopback name to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 takes a free one.")] = 8080,
    sample: Annotated[str, typer.Option(help="Sample session to open a copy of.")] = "rock-step",
    session: Annotated[str | None, typer.Option(help="Open this session of the data folder instead.")] = None,
    data: Data = DEFAULT_DATA,
    sim: Annotated[bool, typer.Option("--sim/--no-sim", help="Run a simulated rover.")] = True,
    seed: Annotated[int, typer.Option(help="Seed of the simulated cameras' noise.")] = 0,
) -> None:
    """Serve the operator's page, the REST interface and a simulated rover until Ctrl-C."""
    from footfall_ui.app import serve as run

    def ready(url: str) -> None:
        # at once, also into a pipe: scripts wait for this line
        typer.echo(f"FootFall answers on {url}")
        sys.stdout.flush()

    run(host, port, sample=sample, session=session, folder=data.expanduser(), sim=sim, seed=seed, on_ready=ready)


@app.command()
def replay(
    bundles: Annotated[list[Path], typer.Argument(help="Session folders or zips.", metavar="BUNDLE…")],
    check: Annotated[bool, typer.Option("--check/--no-check", help="Recompute and compare every product.")] = True,
    as_json: Json = False,
) -> None:
    """Recompute what sessions recorded; exit code 1 where a product differs."""
    from footfall.session.replay import replay as run

    reports: dict[str, Any] = {}
    missing = [str(path) for path in bundles if not path.exists()]
    if missing:
        raise NotFound(f"there is no session at {', '.join(missing)}")
    for path in bundles:
        with bar(f"replay {path.name}") as progress:
            report = run(path, check=check, progress=progress)
        reports[str(path)] = report
        for one in report.products:
            text = f"{one.kind:<9} {one.recorded[:12]}  {one.verdict}" + (f": {one.text}" if one.text else "")
            say(text, as_json)
        for text in report.problems:
            say(f"problem: {text}", as_json)
        verdict = "the same" if report.ok else "NOT the same"
        say(f"{path}: {report.events} events, {len(report.products)} products, {verdict}", as_json)
    ok = all(report.ok for report in reports.values())
    if as_json:
        terminal.show({"ok": ok, "bundles": {path: report.as_dict() for path, report in reports.items()}})
    raise typer.Exit(0 if ok else 1)


@terrain_app.command("build")
def terrain_build(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Session folder or zip that holds images; or left and right image. Last: terrain file to write.",
            metavar="(BUNDLE | LEFT RIGHT) OUT",
        ),
    ],
    calibration: Annotated[
        Path | None, typer.Option(help="JSON: focal_length, cx, cy [px], baseline [m] of LEFT and RIGHT, rectified.")
    ] = None,
    resolution: Annotated[float, typer.Option(help="Cell size [m].")] = 0.02,
    half_size: Annotated[float, typer.Option(help="How far the map reaches to each side [m].")] = 4.0,
    min_range: Annotated[float, typer.Option(help="Nearest ground that is looked for [m].")] = 1.0,
    max_range: Annotated[float, typer.Option(help="Farthest ground that is looked for [m].")] = 8.0,
    matcher: Annotated[str, typer.Option(help='"hh" or "3way".')] = "hh",
    as_json: Json = False,
) -> None:
    """Rebuild the ground from the images of a recorded session, or from a photographed stereo pair."""
    from footfall.io.pair_files import read_calibrated_pair
    from footfall.io.terrain_files import write_terrain
    from footfall.recorded import Recorded
    from footfall.terrain.build import build_terrain, terrain_from_pair
    from footfall.terrain.settings import TerrainSettings

    *sources, out = files
    settings = TerrainSettings(
        resolution=resolution, half_size=half_size, min_range=min_range, max_range=max_range, matcher=matcher
    )
    with bar("terrain") as progress:
        match sources, calibration:
            case [bundle], None:
                session = Recorded(bundle)
                dem = build_terrain(session.robot(), session.snapshot(), settings, progress)
            case [left, right], Path():
                dem = terrain_from_pair(read_calibrated_pair(left, right, calibration), settings)
            case _:
                raise InvalidInput("give BUNDLE OUT, or LEFT RIGHT OUT with --calibration")
    write_terrain(dem, out)
    terminal.show_terrain(dem, as_json, out)


@terrain_app.command("info")
def terrain_info(
    path: Annotated[Path, typer.Argument(help="Terrain file.")],
    scale: Annotated[float, typer.Option(help="Multiply all coordinates.")] = 1.0,
    resolution: Annotated[float | None, typer.Option(help="Cell size [m], for meshes.")] = None,
    as_json: Json = False,
) -> None:
    """Say what a terrain file holds."""
    from footfall.io.terrain_files import read_terrain

    terminal.show_terrain(read_terrain(path, scale=scale, resolution=resolution), as_json)


@terrain_app.command("convert")
def terrain_convert(
    source: Annotated[Path, typer.Argument(help="Terrain file to read.")],
    out: Annotated[Path, typer.Argument(help="Terrain file to write; its ending decides the format.")],
    scale: Annotated[float, typer.Option(help="Multiply all coordinates.")] = 1.0,
    resolution: Annotated[float | None, typer.Option(help="Cell size [m].")] = None,
    center: Annotated[bool, typer.Option("--center", help="Move the middle to (0, 0).")] = False,
    size: Annotated[Pair | None, typer.Option(help="East and north extent of an image [m].")] = None,
    height_range: Annotated[Pair | None, typer.Option(help="Heights of black and white [m].")] = None,
    as_json: Json = False,
) -> None:
    """Read one terrain format and write another."""
    from footfall.io.terrain_files import read_terrain, write_terrain

    dem = read_terrain(
        source,
        scale=scale,
        resolution=resolution,
        center=center or None,
        size=size,
        height_range=height_range,
    )
    write_terrain(dem, out)
    terminal.show_terrain(dem, as_json, out)


@app.command("map")
def make_map(
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    leg: LegNumber,
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    layer: Annotated[str, typer.Option(help="Layer to write.")] = "footing",
    out: Annotated[Path | None, typer.Option(help="Write the layer as .png (north up) or .npy (row 0 south).")] = None,
    conservative: Conservative = False,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Map where one leg could stand, from a stance on a terrain."""
    from footfall.maps.layers import MapSettings
    from footfall.maps.stack import compute_maps

    body, dem, state = terminal.stance(robot, terrain, x, y, yaw)
    with bar("maps") as progress:
        stack = compute_maps(body, dem, state, leg, MapSettings(conservative=conservative), progress)
    if out is not None:
        terminal.write_layer(stack, layer, out)
    terminal.show_maps(stack, as_json, out)


@plan_app.command("step")
def plan_step(
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    leg: LegNumber,
    target: Annotated[Pair, typer.Option(help="Where the wheel is to touch, x and y [m].")],
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    planner: Annotated[str, typer.Option(help="auto, line, astar, sbl or rrtconnect.")] = "auto",
    seed: Annotated[int, typer.Option(help="Same seed, same plan.")] = 0,
    conservative: Conservative = False,
    time_limit: Annotated[float, typer.Option(help="Give up after this long [s].")] = 30.0,
    out: Annotated[Path | None, typer.Option(help="Write the answer as .npz, for `footfall export`.")] = None,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Plan one step from a stance on a terrain; exit code 1 where the answer is no."""
    from footfall.io.artifacts import encode
    from footfall.planning.step.plan import plan_step as run
    from footfall.planning.step.problem import Status, StepSettings

    body, dem, state = terminal.stance(robot, terrain, x, y, yaw)
    settings = StepSettings(planner=planner, seed=seed, conservative=conservative, time_limit=time_limit)
    with bar("plan") as progress:
        result = run(body, dem, state, leg, target, settings=settings, progress=progress)
    if out is not None:
        out.write_bytes(encode(result))
    terminal.show_plan(result, as_json)
    raise typer.Exit(0 if result.status is Status.FOUND else 1)


@app.command()
def export(
    source: Annotated[Path, typer.Argument(help="Session folder or zip, or the .npz of `footfall plan step --out`.")],
    format: Annotated[str, typer.Option("--format", help="json, csv or seqjson.")] = "seqjson",
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write; otherwise stdout.")] = None,
    as_json: Json = False,
) -> None:
    """Write a session's sequence, or the commands of a plan, as a file for others."""
    from footfall.io.exports import export as run
    from footfall.recorded import sequence_of

    sequence = sequence_of(source)
    content = run(sequence, format, out)
    if as_json:
        terminal.show({"sequence": sequence.digest, "commands": len(sequence.commands), "bytes": len(content)})
    elif out is None:
        typer.echo(content, nl=False)
    else:
        typer.echo(f"{len(sequence.commands)} commands written to {out}")


@app.command()
def sim(
    terrain: Annotated[Path, typer.Argument(help="Terrain file that is the rover's world.")],
    url: Annotated[str, typer.Option(help="Rover link of the server.")] = "ws://127.0.0.1:8080/api/v1/rover",
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    seed: Annotated[int, typer.Option(help="Seed of the cameras' noise.")] = 0,
    robot: RobotName = "athlete",
) -> None:
    """Run a simulated rover on the link of a server until Ctrl-C."""
    from footfall.sim.process import Start, run_rover

    run_rover(url, terrain, robot, seed, start=Start(x, y, yaw))


@app.command()
def sessions(data: Data = DEFAULT_DATA, as_json: Json = False) -> None:
    """List the sessions of the data folder and the samples."""
    from footfall.session.registry import Sessions

    with Sessions(data.expanduser()) as registry:
        found, samples = registry.list(), registry.samples()
    if as_json:
        terminal.show({"sessions": found, "samples": samples})
        return
    for one in found:
        typer.echo(f"{one['id']}  {one['name']}  {one['robot']}  {one['events']} events")
    typer.echo(f"samples: {', '.join(samples) or 'none'}")


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


@app.command()
def doctor(as_json: Json = False) -> None:
    """Check that everything FootFall needs is here; exit code 1 where something is missing."""
    from footfall.doctor import examine

    findings = examine()
    if as_json:
        terminal.show({"ok": all(one.ok for one in findings), "findings": findings})
    else:
        for one in findings:
            typer.echo(f"{'ok  ' if one.ok else 'FAIL'}  {one.what:<24} {one.text}")
    raise typer.Exit(0 if all(one.ok for one in findings) else 1)
