"""The command ``footfall plan gait``: a gait to a goal, or which step fails which check by how much."""

import time
from pathlib import Path
from typing import Annotated

import typer

from footfall.cli import terminal
from footfall.cli.plan_walk import GOAL_YAW, Goal
from footfall.cli.terminal import AtX, AtY, AtYaw, Json, RobotName, bar
from footfall.core.value import fields_of
from footfall.planning.answers import Status
from footfall.planning.gait.problem import GAITS, TRIPOD, GaitPlan, GaitResult, GaitSettings
from footfall.planning.walk.problem import WalkGoal


def plan_gait(
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    goal: Goal,
    goal_yaw: Annotated[float | None, typer.Option(GOAL_YAW, help="That heading [rad]; otherwise it is kept.")] = None,
    gait: Annotated[str, typer.Option(help=f"One of {', '.join(GAITS)}.")] = TRIPOD,
    stride: Annotated[
        float, typer.Option(help="How far a foot goes in one cycle, at most [m].")
    ] = GaitSettings().stride,
    arc: Annotated[bool, typer.Option("--arc", help="Go on an arc of a circle, ahead along the heading.")] = False,
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the answer as .npz; of a wave for `footfall export`.", callback=terminal.writable),
    ] = None,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Plan a gait to a goal, or say at which step which check fails by how much; exit code 1 where the answer is no."""
    from footfall.io.artifacts import encode
    from footfall.io.whole_files import write_whole
    from footfall.planning.gait.plan import plan_gait as run

    settings = GaitSettings(gait=gait, stride=stride, arc=arc)
    body, dem, state = terminal.stance(robot, terrain, x, y, yaw)
    began = time.monotonic()
    with bar("gait") as progress:
        result = run(body, dem, state, WalkGoal(*goal, yaw=goal_yaw), settings=settings, progress=progress)
    seconds = time.monotonic() - began
    if out is not None:
        write_whole(out, encode(result))
    _show(result, seconds, as_json)
    raise typer.Exit(0 if result.status is Status.FOUND else 1)


def _show(result: GaitResult, seconds: float, as_json: bool) -> None:
    made = result.plan or result.partial
    if as_json:
        fields = {name: field for name, field in fields_of(result).items() if name not in ("plan", "partial")}
        figures = None if made is None else _figures(made)
        terminal.show({**fields, "digest": result.digest, "figures": figures, "seconds": seconds})
        return
    typer.echo(f"{result.status.value}: {result.reason}" if result.reason else result.status.value)
    terminal.show_checks(result.checks)
    if made is not None:
        fields = ", ".join(f"{name.replace('_', ' ')} {number:.3g}" for name, number in _figures(made).items())
        typer.echo(f"{'all the way' if result.plan else 'as far as it comes'}: {fields}")
    typer.echo(f"planned in {seconds:z.2f} s")


def _figures(plan: GaitPlan) -> dict[str, float]:
    """What a gait comes to. Lengths [m]; largest_torque: share of a joint's limit."""
    return {
        "steps": len(plan.groups),
        "feet_moved": plan.feet_moved,
        "chassis_way": plan.chassis_way,
        "stride": plan.stride,
        "height": plan.height,
        "tread": plan.tread,
        "least_margin": float(plan.margins.min()),
        "largest_torque": float(plan.torques.max()),
    }
