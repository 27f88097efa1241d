"""The command ``footfall map``: where one leg could stand, as a text, a list of footfalls, a picture or a file."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from footfall.cli import terminal
from footfall.cli.legged import make_legged_map
from footfall.cli.terminal import AtX, AtY, AtYaw, Conservative, Json, LegNumber, RobotName, bar
from footfall.core.errors import InvalidInput
from footfall.maps.layers import REACHABLE_STABLE, REACHABLE_UNSTABLE, MapSettings, MapStack
from footfall.maps.quality_settings import MOST

if TYPE_CHECKING:
    from footfall.maps.suggest import Suggestions

EARTH = "earth"
PICTURED = "footing"
"""The layer that a picture or an array shows unless another is named."""


def make_map(
    terrain: Annotated[Path, typer.Argument(help="Terrain file.")],
    leg: LegNumber,
    x: AtX = 0.0,
    y: AtY = 0.0,
    yaw: AtYaw = 0.0,
    layer: Annotated[
        str | None, typer.Option(help=f"Which layer goes into a .png or .npy; {PICTURED} unless named.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write all layers as .tif or .npz, or one as .png (north up) or .npy (row 0 south)."),
    ] = None,
    conservative: Conservative = False,
    friction_aware: Annotated[
        bool, typer.Option("--friction-aware", help="Make the layers with friction and torques too; takes seconds.")
    ] = False,
    friction: Annotated[
        float | None, typer.Option(help="Coefficient between wheel and ground; asks for those layers, too.")
    ] = None,
    gravity: Annotated[str, typer.Option(help="earth, moon, mars, or a number [m/s²].")] = EARTH,
    count: Annotated[
        int, typer.Option("--suggest", min=0, max=MOST, help="Name so many of the best footfalls, with reasons.")
    ] = 0,
    robot: RobotName = "athlete",
    as_json: Json = False,
) -> None:
    """Map where one leg could stand, from a stance on a terrain."""
    from footfall.io.any_robot import is_legged
    from footfall.io.map_files import ONE, require_map_file, write_maps
    from footfall.maps.choice import stack_quality
    from footfall.maps.suggest import suggest
    from footfall.planning.step.leg_maps import compute_maps

    if out is not None:
        if layer is None and out.suffix.lower() in ONE:
            layer = PICTURED
        require_map_file(out, layer)
    elif layer is not None:
        raise InvalidInput("--layer needs --out, the file that it goes into")
    if is_legged(robot):
        others = {
            "--friction-aware": friction_aware,
            "--friction": friction is not None,
            "--gravity": gravity != EARTH,
            "--suggest": count > 0,
        }
        make_legged_map(robot, terrain, leg, (x, y, yaw), conservative, out, layer, as_json, others)
        return
    settings = _settings(conservative, friction_aware, friction, _gravity(gravity))
    body, dem, state = terminal.stance(robot, terrain, x, y, yaw)
    with bar("maps") as progress:
        stack = compute_maps(body, dem, state, leg, settings, progress)
    best = suggest(stack_quality(body, dem, state, stack), count, 2 * body.wheel_radius, False) if count else None
    if out is not None:
        write_maps(stack, out, layer)
    _show(stack, best, as_json, out)


def _settings(conservative: bool, friction_aware: bool, friction: float | None, gravity: float) -> MapSettings:
    """friction: coefficient between wheel and ground, None: as usual; gravity [m/s²]."""
    from footfall.balance.balance_settings import BalanceSettings

    balance = BalanceSettings(gravity=gravity)
    if friction is not None:
        balance = replace(balance, friction=friction)
    return MapSettings(conservative=conservative, friction=friction_aware or friction is not None, balance=balance)


def _gravity(text: str) -> float:
    """Gravity [m/s²] of a place or a number. Raises InvalidInput, NotFound naming the places."""
    from footfall.balance.balance_settings import gravity_named

    try:
        return float(text)
    except ValueError:
        return gravity_named(text)


def _show(stack: MapStack, best: "Suggestions | None", as_json: bool, written: Path | None) -> None:
    """How much of the ground the leg can use, and where best."""
    cell = stack.geometry.resolution**2
    footing = stack.layers.get("footing_friction", stack.layers["footing"])
    area = {
        name: float((footing == number).sum() * cell)
        for name, number in (("stable", REACHABLE_STABLE), ("unstable", REACHABLE_UNSTABLE))
    }
    if as_json:
        about = {
            "digest": stack.digest,
            "leg": stack.leg,
            "stability": stack.stability,
            "layers": list(stack.layers),
            "area_m2": area,
            "not_lifted": stack.not_lifted,
            "written": None if written is None else str(written),
        }
        terminal.show(about if best is None else {**about, "suggestions": best})
        return
    typer.echo(
        f"leg {stack.leg}: {area['stable']:z.2f} m² reachable and stable, {area['unstable']:z.2f} m² reachable only"
    )
    if stack.not_lifted:
        typer.echo(f"⊘ leg {stack.leg} can't step anywhere: {stack.not_lifted}")
    for rank, one in enumerate(best.footfalls if best is not None else (), 1):
        reasons = (*(() if one.apart is None else (one.apart.text,)), *one.reasons)
        typer.echo(f"{rank}. ({one.x:z.2f}, {one.y:z.2f}) m, {one.score:z.3f} of 1: {'; '.join(reasons)}")
    if best is not None and best.reason:
        typer.echo(best.reason)
    if written is not None:
        typer.echo(f"written to {written}")
