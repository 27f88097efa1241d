"""Which footfall to choose: quality, suggestions and read-outs on a stack of maps."""

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.maps.layers import MapSettings, MapStack
from footfall.maps.quality import Layers, LegSituation, Quality, quality, situation_of
from footfall.maps.quality_settings import QualitySettings
from footfall.maps.suggest import Explanation, explain
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

NOT_ASKED = ("quality", "footing_friction", "margin_friction", "margin_friction_conservative")
"""Layers that follow from others, or stand in for others."""


def stack_quality(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    stack: MapStack,
    settings: QualitySettings | None = None,
    towards: tuple[float, float] | None = None,
) -> Quality:
    """The quality of every cell of a stack.

    Where the stack has the layers with friction, they decide; else the geometric ones do.

    Args:
        robot: that the stack was made with.
        dem: that the stack was made with.
        state: that the stack was made with.
        stack: maps of one leg.
        settings: how quality is judged; None: those that the stack was made with.
        towards: (east, north) in which the body is to advance; None: nowhere.

    Returns:
        Goodness and what refuses, on the stack's grid.
    """
    made_with = stack.provenance.settings
    if settings is None:
        settings = made_with.quality if isinstance(made_with, MapSettings) else QualitySettings()
    situation = situation_of(robot, state, stack.leg, towards)
    return layers_quality(dem, stack.geometry, stack.layers, stack.stability == "conservative", situation, settings)


def layers_quality(
    dem: Dem,
    geometry: GridGeometry,
    made: Layers,
    conservative: bool,
    situation: LegSituation,
    settings: QualitySettings,
) -> Quality:
    """:func:`stack_quality` of layers that are not a stack yet; conservative: which margins footing was decided by."""
    every = round(geometry.resolution / dem.geometry.resolution)
    layers = {name: layer for name, layer in made.items() if name not in NOT_ASKED}
    layers["height"] = dem.heights[::every, ::every]
    suffix = "_conservative" if conservative else ""
    layers["margin"] = made["margin" + suffix]
    if "footing_friction" in made:
        layers["footing"] = made["footing_friction"]
        layers["margin"] = made["margin_friction" + suffix]
    return quality(geometry, layers, situation, settings)


def explain_at(found: Quality, x: float, y: float) -> Explanation:
    """What every layer says of one cell.

    Args:
        found: quality of a stack.
        x: east, in site [m].
        y: north, in site [m].

    Returns:
        What speaks for the cell at that place, and what against it.

    Raises:
        InvalidInput: the place is outside the map.
    """
    if not np.isfinite([x, y]).all() or not found.geometry.contains(x, y):
        west, south, east, north = found.geometry.bounds
        raise InvalidInput(
            f"({x:g}, {y:g}) m lies outside the map, which reaches from ({west:g}, {south:g}) to ({east:g}, {north:g})",
            x=x,
            y=y,
        )
    row, col = (int(i) for i in found.geometry.cell(x, y))
    return explain(found, row, col)
