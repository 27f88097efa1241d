"""The command ``footfall plan gait``: a gait to a goal, and which step fails which check by how much."""

from pathlib import Path
from typing import Annotated

import typer

from footfall import terminal
from footfall.core.value import fields_of
from footfall.planning.gait.problem import TRIPOD
from footfall.planning.step.problem import Status
from footfall.terminal import AtX, AtY, AtYaw, Json, Pair, RobotName, bar


def plan_gait(
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    goal: Annotated[Pair, typer.Option("--goal", help="Where the chassis is to be, x and y [m].")],
    gait: Annotated[str, typer.Option(help="tripod or wave.")] = TRIPOD,
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Plan a gait straight to a goal, its heading kept; exit code 1 where a check fails."""
    from footfall.planning.gait.plan import plan_gait as run

    body, dem, state = terminal.stance(robot, terrain, x, y, yaw)
    with bar("gait") as progress:
        result = run(body, dem, state, goal, gait, progress=progress)
    if as_json:
        told = {name: field for name, field in fields_of(result).items() if name not in ("plan", "failed")}
        terminal.show({**told, "digest": result.digest})
    else:
        typer.echo(f"{result.status.value}: {result.reason}" if result.reason else result.status.value)
        typer.echo(f"the chassis goes {result.walked:.2f} m before a check fails")
        for failure in result.failures:
            typer.echo(f"  {failure.told}")
    raise typer.Exit(0 if result.status is Status.FOUND else 1)
