"""The command ``footfall plan step``: one leg from a stance onto a place, and what to command for it, or why not."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from footfall.cli import terminal
from footfall.cli.terminal import AtX, AtY, AtYaw, Conservative, Json, LegNumber, Pair, RobotName, bar
from footfall.planning.step.problem import GOAL_ORDERS, PLANNERS, StepSettings


def plan_step(
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    leg: LegNumber,
    target: Annotated[Pair, typer.Option(help="Where the wheel or foot is to touch, x and y [m].", metavar="X Y")],
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    planner: Annotated[
        str | None, typer.Option(help=f"One of {', '.join(PLANNERS)}; otherwise {StepSettings().planner}.")
    ] = None,
    goals: Annotated[
        str | None,
        typer.Option(
            help=f"Which goal posture first: by {' or '.join(GOAL_ORDERS)}; otherwise by {StepSettings().goals}."
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Same seed, same plan; otherwise 0.")] = None,
    conservative: Conservative = False,
    time_limit: Annotated[float, typer.Option(help="Give up after this long [s].")] = StepSettings().time_limit,
    as_commanded: Annotated[
        bool, typer.Option("--as-commanded", help="Command what is planned; the rover's sag is not predicted.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Write the answer as .npz, for `footfall export`.", callback=terminal.writable)
    ] = None,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Plan one step from a stance on a terrain, and what to command for it; exit code 1 where the answer is no.

    It is commanded so that the chassis keeps its pose although the rover sags. Of a robot of your own the step alone is
    planned; `footfall export` makes its commands.
    """
    from footfall.cli.legged import plan_legged_step
    from footfall.io.any_robot import is_legged
    from footfall.io.artifacts import encode
    from footfall.io.whole_files import write_whole
    from footfall.planning.answers import Status
    from footfall.planning.execution.execution_settings import ExecutionSettings
    from footfall.planning.execution.plan import plan_execution
    from footfall.planning.legged.problem import LeggedSettings
    from footfall.planning.step.plan import plan_step as run
    from footfall.sequence.as_planned import as_planned

    asked: dict[str, Any] = {"planner": planner, "goals": goals, "seed": seed}
    given = {name: one for name, one in asked.items() if one is not None}
    if is_legged(robot):
        others = {**{f"--{name}": True for name in given}, "--as-commanded": as_commanded}
        limits = LeggedSettings(conservative=conservative, time_limit=time_limit)
        plan_legged_step(robot, terrain, leg, target, (x, y, yaw), limits, out, as_json, others)
    body, dem, state = terminal.stance(robot, terrain, x, y, yaw)
    settings = replace(StepSettings(conservative=conservative, time_limit=time_limit), **given)
    with bar("plan") as progress:
        result = run(body, dem, state, leg, target, settings=settings, progress=progress)
    done = None
    if result.plan is not None and not as_commanded:
        with bar("command") as progress:
            executed = as_planned(result.plan, ExecutionSettings())
            done = plan_execution(body, dem, state, result.plan, executed, progress=progress)
    if out is not None:
        write_whole(out, encode(done or result))
    terminal.show_plan(result, done, as_json)
    raise typer.Exit(0 if (done or result).status is Status.FOUND else 1)
