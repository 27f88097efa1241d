"""The command ``footfall plan walk``: from a stance to a goal in many foot moves, checked, or why not."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer.core import TyperCommand

from footfall.balance.tether import EDGE, Tether
from footfall.cli import terminal
from footfall.cli.terminal import AtX, AtY, AtYaw, Json, Pair, RobotName, bar
from footfall.core.errors import InvalidInput
from footfall.core.value import fields_of
from footfall.planning.answers import Status
from footfall.planning.execution.execution_settings import HELD, MODES, ExecutionSettings
from footfall.planning.walk.problem import (
    Blocked,
    Tethered,
    WalkGoal,
    WalkPlan,
    WalkResult,
    WalkSettings,
    foot_moves_in_words,
)
from footfall.planning.walk.smoothing import Smoothed, Smoothing
from footfall.planning.walk_execution.problem import WalkExecutionResult

GOAL, GOAL_YAW = "--goal", "--goal-yaw"
TETHERS = ("tether_at", "tether_force", "tether_length")
ATHLETES = ("mode", "tether", *TETHERS, "posture", "payload", "payload_at", "seed", "rounds")
"""What no walk of a robot that others described takes."""
Goal = Annotated[
    Pair,
    typer.Option(
        GOAL, help="Where the chassis is to be, x and y [m]; a third number: its heading [rad].", metavar="X Y [YAW]"
    ),
]


class WithGoal(TyperCommand):
    """A command whose ``--goal`` takes two numbers or three."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, yaw_apart(args))


def yaw_apart(arguments: Sequence[str]) -> list[str]:
    """Arguments with the third number after ``--goal``, where there is one, as ``--goal-yaw``."""
    apart = list(arguments)
    told = any(one == GOAL_YAW or one.startswith(f"{GOAL_YAW}=") for one in apart)
    at = apart.index(GOAL) + 3 if GOAL in apart else len(apart)
    if at < len(apart) and _is_number(apart[at]):
        if told:
            raise InvalidInput(f"the heading is said twice, by {GOAL_YAW} and by the third number of {GOAL}")
        apart.insert(at, GOAL_YAW)
    return apart


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def plan_walk(
    context: typer.Context,
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    goal: Goal,
    goal_yaw: Annotated[
        float | None, typer.Option(GOAL_YAW, help="That heading [rad]; otherwise whichever way it faces.")
    ] = None,
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    at: Annotated[
        tuple[float, float, float] | None, typer.Option("--at", help="--x, --y and --yaw in one.", metavar="X Y YAW")
    ] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same walk.")] = 0,
    time_limit: Annotated[float, typer.Option(help="Give up after this long [s].")] = WalkSettings().time_limit,
    margin: Annotated[
        float | None,
        typer.Option(help="How far inside the feet that stand the centre of mass stays, seen from above [m]."),
    ] = None,
    rounds: Annotated[int, typer.Option(help="Rounds of smoothing; 0: the walk as it is found.")] = Smoothing().rounds,
    posture: Annotated[
        str | None, typer.Option(help="Posture of the robot whose height the chassis comes near: stand, crouch, tall.")
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(help=f"Plan also what to command a rover that sags: {' or '.join(HELD)}. --out then has that."),
    ] = None,
    tether: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="The rover hangs on a tether: its anchor in site [m].", metavar="X Y Z"),
    ] = None,
    tether_at: Annotated[
        tuple[float, float, float],
        typer.Option(help="Where the tether leaves the chassis, in base [m].", metavar="X Y Z"),
    ] = EDGE,
    tether_force: Annotated[float, typer.Option(help="The most that its drum pulls with [N].")] = 12_000.0,
    tether_length: Annotated[float, typer.Option(help="The most that its drum pays out [m].")] = 30.0,
    payload: Annotated[float | None, typer.Option(help="Mass on the deck [kg]; otherwise the description's.")] = None,
    payload_at: Annotated[
        tuple[float, float, float] | None, typer.Option(help="Its centre in base [m].", metavar="X Y Z")
    ] = None,
    circulating: Annotated[
        bool, typer.Option("--circulating", help="Legs on two stacks, as the Ambler's, pass through the body.")
    ] = False,
    along: Annotated[
        Path | None,
        typer.Option(help="A robot of your own goes along this route: a file that `footfall plan route` wrote."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the answer as .npz, for `footfall export`.", callback=terminal.writable)
    ] = None,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Plan a walk from a stance on a terrain to a goal; exit code 1 where the answer is no.

    The rover is taken as rigid, its sag not predicted, but with --mode.
    """
    from footfall.cli.legged import plan_legged_walk
    from footfall.io.any_robot import is_legged, load_legged
    from footfall.io.artifacts import encode
    from footfall.io.whole_files import write_whole
    from footfall.planning.legged.circulate import MARGIN
    from footfall.planning.legged.problem import LeggedSettings
    from footfall.planning.walk.plan import plan_walk as run
    from footfall.planning.walk_execution.plan import plan_walk_execution
    from footfall.sequence.as_planned import as_planned

    wanted = WalkGoal(*goal, yaw=goal_yaw)
    if at is not None:
        terminal.refuse_typed(context, ("x", "y", "yaw"), "can't go with --at, which says the same")
    if is_legged(robot):
        others = dict.fromkeys(terminal.typed(context, ATHLETES), True)
        own = load_legged(robot)
        usual = MARGIN if circulating else LeggedSettings().least_margin
        share = usual if margin is None else margin / own.length
        limits = LeggedSettings(time_limit=time_limit, least_margin=share)
        where = at or (x, y, yaw)
        plan_legged_walk(own, terrain, wanted, where, limits, out, as_json, others, circulating, along)
    if along is not None:
        raise InvalidInput("--along is for robots of your own: walks of ATHLETE's build find their way themselves")
    if circulating:
        raise InvalidInput("--circulating is for legs on two stacks, as those of --robot ambler")
    if mode is not None and mode not in HELD:
        raise InvalidInput(f"--mode is one of {', '.join(HELD)}", mode=mode)
    if tether is None:
        terminal.refuse_typed(context, TETHERS, "say more of a tether, and there is none: give --tether")
    elif mode is not None:
        raise InvalidInput("--mode can't go with --tether: how a rover sags on one is not predicted")
    if not rounds:
        terminal.refuse_typed(context, ["posture"], "is come near by smoothing: give --rounds above 0")
    smoothing = Smoothing(rounds=rounds, posture=posture)
    place = None if payload_at is None else np.array(payload_at)
    settings = WalkSettings(
        seed=seed,
        time_limit=time_limit,
        least_margin=WalkSettings().least_margin if margin is None else margin,
        smoothing=smoothing,
        payload_mass=payload,
        payload_position=place,
    )
    hung = None
    if tether is not None:
        hung = Tether(np.array(tether), np.array(tether_at), tether_force, tether_length)
    body, dem, state = terminal.stance(robot, terrain, *(at or (x, y, yaw)), tether=hung)
    began = time.monotonic()
    with bar("walk") as progress:
        result = run(body, dem, state, wanted, settings=settings, progress=progress, tether=hung)
    seconds = time.monotonic() - began
    done = None
    if result.plan is not None and mode is not None:
        with bar("command") as progress:
            executed = as_planned(result.plan, ExecutionSettings(mode=mode))
            done = plan_walk_execution(body, dem, state, result.plan, executed, progress=progress)
    if out is not None:
        write_whole(out, encode(done or result))
    _show(result, done, seconds, as_json)
    raise typer.Exit(0 if (done or result).status is Status.FOUND else 1)


def _show(result: WalkResult, done: WalkExecutionResult | None, seconds: float, as_json: bool) -> None:
    """The answer to a request for a walk, with its checks; done: how it is commanded, None: as planned; seconds: how
    long planning took.
    """
    if as_json:
        figures = None if result.plan is None else _figures(result.plan)
        partial = None if result.partial is None else _figures(result.partial)
        answer = {"digest": result.digest, "figures": figures, "partial_figures": partial, "seconds": seconds}
        commands = terminal.commands_made(result, done)
        terminal.show({**fields_of(result), **answer, "commands": commands})
        return
    typer.echo(f"{result.status.value}: {result.reason}" if result.reason else result.status.value)
    terminal.show_checks(result.checks)
    for one in result.blocked:
        typer.echo(f"  blocked {one.count} times by {_blocked_in_words(one)}")
    if result.plan is not None:
        typer.echo(f"{_in_words(result.plan)}, digest {result.plan.digest}")
        if result.plan.tethered is not None:
            typer.echo(_tether_in_words(result.plan, result.plan.tethered))
    if result.smoothed is not None:
        typer.echo(f"smoothed: {_smoothed_in_words(result.smoothed)}")
    if result.partial is not None:
        away = float(np.hypot(*(result.partial.Ts_site_base[-1, :2, 3] - (result.goal.x, result.goal.y))))
        typer.echo(f"as far as it comes, {away:z.2f} m from the goal: {_in_words(result.partial)}")
    typer.echo(f"planned in {seconds:z.2f} s")
    if done is not None:
        title, text = MODES[terminal.mode_of(done)]
        typer.echo(f"{title}: {text}" if done.status is Status.FOUND else f"not {title}: {done.reason}")
        terminal.show_checks(done.checks)


def _figures(plan: WalkPlan) -> dict[str, float]:
    """What a walk comes to. chassis_way, least_margin [m]; largest_torque: share of a joint's limit."""
    return {
        "foot_moves": plan.foot_moves,
        "steps": 2 * plan.foot_moves,
        "chassis_way": plan.chassis_way,
        "least_margin": float(plan.margins.min()),
        "largest_torque": float(plan.torques.max()),
    }


def _in_words(plan: WalkPlan) -> str:
    figures = _figures(plan)
    return (
        f"{foot_moves_in_words(plan)} ({figures['steps']} steps), the chassis goes {figures['chassis_way']:z.2f} m, "
        f"least margin {figures['least_margin']:z.3f} m, largest torque {figures['largest_torque']:.0%} of its limit"
    )


def _tether_in_words(plan: WalkPlan, tethered: Tethered) -> str:
    lengths, pulls = tethered.lengths, tethered.pulls
    each = ", ".join(f"{one:z.2f}" for one in plan.paid_out)
    return (
        f"tether: {lengths[0]:z.2f} → {lengths[-1]:z.2f} m, pulled with {pulls.min():z.0f} to {pulls.max():z.0f} N, "
        f"paid out in each foot move and after the last {each} m"
    )


def _smoothed_in_words(smoothed: Smoothed) -> str:
    old, new = smoothed.before, smoothed.after
    return (
        f"foot moves {old.foot_moves} → {new.foot_moves}, the chassis' way {old.chassis_way:z.2f} → "
        f"{new.chassis_way:z.2f} m, joints' turning {old.turning:z.1f} → {new.turning:z.1f} rad, largest torque "
        f"{old.largest_torque:.0%} → {new.largest_torque:.0%}, in the mean of foot moves {old.mean_torque:.0%} → "
        f"{new.mean_torque:.0%}, least margin {old.least_margin:z.3f} → {new.least_margin:z.3f} m"
        f"{'; the time limit cut it short: with a longer one the walk may be better' if smoothed.cut_short else ''}"
    )


def _blocked_in_words(blocked: Blocked) -> str:
    leg = "" if blocked.leg is None else f" of leg {blocked.leg}"
    known = np.isfinite([blocked.x, blocked.y]).all()
    return f"{blocked.check_name}{leg}" + (f" at ({blocked.x:z.2f}, {blocked.y:z.2f}) m" if known else "")
