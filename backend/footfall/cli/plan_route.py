"""The command ``footfall plan route``: the cheapest way of the chassis over a terrain, or why there is none."""

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from footfall.cli import terminal
from footfall.cli.terminal import AtX, AtY, AtYaw, Json, Pair, RobotName, bar
from footfall.core.progress import Progress
from footfall.core.value import fields_of
from footfall.planning.answers import Status
from footfall.planning.route.problem import Route, RouteResult, RouteSettings, settings_by_leg


def plan_route(
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    goal: Annotated[Pair, typer.Option("--goal", help="Where the chassis is to be, x and y [m].", metavar="X Y")],
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    worst: Annotated[
        float, typer.Option(help="Least mean goodness × certainty of the ground under the rover, 0…1.")
    ] = RouteSettings().worst,
    resolution: Annotated[
        float | None,
        typer.Option(
            help=f"Of the cells that the way is looked for on [m]; otherwise {RouteSettings().resolution:g} for "
            "ATHLETE, finer for smaller robots."
        ),
    ] = None,
    cost: Annotated[
        str, typer.Option(help="What the ground costs by: goodness, or feasible (footfalls within the legs' reach).")
    ] = RouteSettings().cost,
    turning: Annotated[
        float, typer.Option(help="What a radian of turning on the spot costs [m]; with --cost feasible.")
    ] = RouteSettings().turning,
    together: Annotated[
        bool, typer.Option("--together", help="Search way and headings together: turns decide which way is taken.")
    ] = RouteSettings().together,
    out: Annotated[Path | None, typer.Option(help="Write the answer as .npz.", callback=terminal.writable)] = None,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Plan a route over a terrain to a goal, without footfalls; exit code 1 where the answer is no."""
    from footfall.io.artifacts import encode
    from footfall.io.whole_files import write_whole

    given = {"worst": worst, "cost": cost, "turning": turning, "together": together}
    given |= {} if resolution is None else {"resolution": resolution}
    with bar("route") as progress:
        began, result = _planned(robot, terrain, (x, y, yaw), goal, given, progress)
    seconds = time.monotonic() - began
    if out is not None:
        write_whole(out, encode(result))
    if as_json:
        terminal.show({**fields_of(result), "digest": result.digest, "seconds": seconds})
    else:
        typer.echo(f"{result.status.value}: {result.reason}" if result.reason else result.status.value)
        if result.plan is not None:
            route = result.plan
            mean = route.cost / route.length if route.length else 1.0
            parts = len(route.points) - 1
            typer.echo(
                f"{route.length:z.2f} m in {parts} straight parts, {mean:z.2f} times the cost of the best ground"
            )
            for number, point in enumerate(route.points):
                typer.echo(f"  {point[0]:z8.2f} {point[1]:z8.2f}{_facing(route, number)}")
        typer.echo(f"planned in {seconds:z.2f} s")
    raise typer.Exit(0 if result.status is Status.FOUND else 1)


def _planned(
    robot: str,
    terrain: Path,
    at: tuple[float, float, float],
    goal: tuple[float, float],
    given: Mapping[str, Any],
    progress: Progress,
) -> tuple[float, RouteResult]:
    """When planning began [s], and its answer; of settings that are not given those as delivered for the robot."""
    from footfall.io.any_robot import is_legged, load_legged
    from footfall.io.terrain_files import read_terrain
    from footfall.planning.any_robot import plan_route as run
    from footfall.planning.any_robot import stand

    if is_legged(robot):
        legged, dem = load_legged(robot), read_terrain(terrain)
        settings, start, began = settings_by_leg(legged.length), stand(legged, dem, *at), time.monotonic()
        return began, run(legged, dem, start, goal, replace(settings, **given), progress)
    body, dem, state = terminal.stance(robot, terrain, *at)
    began = time.monotonic()
    return began, run(body, dem, state, goal, RouteSettings(**given), progress)


def _facing(route: Route, number: int) -> str:
    """How the chassis faces from a point of a route on, in words; empty at its end, and where that is not told."""
    if route.headings is None or number == len(route.headings):
        return ""
    return f"  facing {math.degrees(route.headings[number]):z.0f}°"
