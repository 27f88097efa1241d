"""All map layers for one leg: coarse first, then fine."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.progress import Progress, no_progress, part
from footfall.core.value import Provenance
from footfall.maps import binding, reach_classes
from footfall.maps import layers as footing
from footfall.maps.choice import layers_quality
from footfall.maps.layers import MapSettings, MapStack
from footfall.maps.leg_collisions import LegCollisions
from footfall.maps.quality import situation_of
from footfall.maps.reach import Reach, reach
from footfall.maps.stability import StayingFeet, geometric, stance_without, with_friction
from footfall.maps.standing import contacts
from footfall.maps.traversability import Traversability, traversability
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.age import ages
from footfall.terrain.ground.unseen import without_holes

COARSE = 4
"""The preview has every so many-th cell."""
AROUND = 1.5
"""Holes are filled this much farther than the leg reaches [m]."""

_FOOTING = np.zeros(len(reach_classes.CLASSES), np.uint8)
_FOOTING[reach_classes.OUT_OF_RANGE] = footing.OUT_OF_RANGE
_FOOTING[[reach_classes.NO_GEOMETRY, reach_classes.JOINT_LIMIT]] = footing.NO_SOLUTION
_FOOTING[[reach_classes.FOOT_COLLISION, reach_classes.WAYPOINT_COLLISION]] = footing.COLLISION
# the planner may lean the wheel where it can't be raised upright
_FOOTING[[reach_classes.UNSURE, reach_classes.NO_LIFT]] = footing.UNSURE
_FOOTING[reach_classes.NOT_LIFTED] = footing.NOT_LIFTED
_FOOTING[reach_classes.FREE] = footing.REACHABLE_STABLE


def map_stack(
    robot: Robot,
    dem: Dem,
    state: RobotState,
    leg: int,
    settings: MapSettings | None = None,
    progress: Progress = no_progress,
    preview: Callable[[MapStack], None] | None = None,
    not_lifted: Callable[[], str] = lambda: "",
) -> MapStack:
    """Traversability, reachability, stability and quality of ``leg`` on the cells of the terrain.

    Layers of numbers hold NaN where the ground is unknown or what they say has no meaning ("footing" tells why). Cells
    beyond the leg's length have 0 solutions. The same input gives the same digest, with preview or without.

    preview: called with maps of every fourth cell before the fine ones are made; what takes exact collision checks is
    unsure there.
    not_lifted: why the leg can't be lifted from where it stands, which is a matter of planning
    (planning.step.leg_maps); asked where the settings ask for it.
    Raises InvalidInput for a leg that does not exist or a state of another robot.
    """
    settings = settings or MapSettings()
    leg = robot.require_leg(leg)
    if state.robot != robot.name or state.leg_count != robot.leg_count:
        raise InvalidInput(
            f"the state is of {state.robot} with {state.leg_count} legs, "
            f"the robot is {robot.name} with {robot.leg_count}"
        )
    stance = stance_without(robot, dem, state, leg, settings.balance)
    ground = traversability(dem, settings, part(progress, 0.0, 0.1))
    checks = _collisions(robot, dem, state, leg, settings)
    made = _Made(robot, dem, state, leg, settings, stance, ground)
    arguments = robot, dem, state, leg
    if preview is not None:
        quick = None if checks is None else checks.sketch()
        coarse = reach(*arguments, part(progress, 0.1, 0.2), quick, settings.lift, stride=COARSE)
        preview(made.stack(coarse, COARSE, part(progress, 0.2, 0.25)))
    reached = reach(*arguments, part(progress, 0.25, 0.7), checks, settings.lift)
    why = not_lifted() if settings.lift_off and checks is not None else ""
    if why:
        stays = np.isin(reached.reason, (reach_classes.FREE, reach_classes.UNSURE, reach_classes.NO_LIFT))
        reason = np.where(stays, reach_classes.NOT_LIFTED, reached.reason).astype(np.uint8)
        reached = replace(reached, reason=reason)
    stack = made.stack(reached, 1, part(progress, 0.7, 1.0), why)
    progress(1.0, "maps")
    return stack


def _collisions(robot: Robot, dem: Dem, state: RobotState, leg: int, settings: MapSettings) -> LegCollisions | None:
    """Checks against the ground without holes, as the step planner makes them; None: not asked for, or no ground."""
    if not settings.collisions:
        return None
    hip = (np.asarray(state.T_site_base) @ robot.description.legs[leg].T_base_hip)[:2, 3]
    foot = contacts(robot, dem, state.posture, state.T_site_base, [leg]).points
    whole = without_holes(dem, hip, robot.leg_length(leg) + AROUND, foot)
    if whole is None:
        return None
    checks = LegCollisions(robot, state, leg, whole.dem, settings.clearance, settings.raise_terrain)
    return checks.with_certificate()


class _Made:
    """What the layers of all strides are made from."""

    def __init__(
        self,
        robot: Robot,
        dem: Dem,
        state: RobotState,
        leg: int,
        settings: MapSettings,
        stance: StayingFeet,
        ground: Traversability,
    ) -> None:
        self.robot, self.dem, self.state, self.leg = robot, dem, state, leg
        self.settings, self.stance, self.ground = settings, stance, ground

    def stack(self, reached: Reach, stride: int, progress: Progress, not_lifted: str = "") -> MapStack:
        """All layers on every ``stride``-th cell."""
        settings = self.settings
        arguments = self.robot, self.state, self.leg, self.stance, reached, settings.balance
        numbers = geometric(*arguments, settings.conservative)
        progress(0.3, "stability")
        possible = np.isin(reached.reason, (reach_classes.FREE, reach_classes.UNSURE))
        if settings.friction:
            numbers |= with_friction(*arguments, possible)
        progress(0.8, "balance with friction" if settings.friction else "layers")

        grid = _every(self.dem.geometry, stride)
        at = reached.rows // stride, reached.cols // stride
        classes = reached.classes(self.dem)[::stride, ::stride]
        known = classes != reach_classes.UNKNOWN

        def layer(values: NDArray, elsewhere: NDArray | float = np.nan) -> NDArray[np.float32]:
            out = np.full(grid.shape, np.nan, np.float32)
            out[...] = elsewhere
            out[at] = values
            return out

        def stands(stable: NDArray[np.bool_]) -> NDArray[np.uint8]:
            out = _FOOTING[classes]
            unstable = (reached.reason == reach_classes.FREE) & ~stable
            out[at[0][unstable], at[1][unstable]] = footing.REACHABLE_UNSTABLE
            return out

        made = self._of_ground(stride)
        made |= {name: layer(getattr(reached, name)) for name in ("seat", "support", "limit_margin", "manipulability")}
        made["reach_class"] = classes
        blame = np.zeros(grid.shape, np.uint8)
        blame[at] = reached.blame
        made["hindrance"] = reach_classes.hindrances(classes, blame)
        made["solutions"] = layer(reached.solutions, np.where(known, 0.0, np.nan))
        made |= {name: layer(values) for name, values in numbers.items() if values.dtype.kind == "f"}
        for name in ("binding", "binding_lost"):
            codes = np.full(grid.shape, binding.NOTHING, np.uint8)
            codes[at] = numbers[name]
            made[name] = codes
        suffix = "_conservative" if settings.conservative else ""
        lifted = numbers["margin_lifted"] >= settings.stable_margin
        made["footing"] = stands(lifted & (numbers["margin" + suffix] >= settings.stable_margin))
        if settings.friction:
            held = numbers["margin_friction" + suffix] >= settings.stable_margin
            made["footing_friction"] = stands(lifted & held & (numbers["torque_ratio"] <= 1.0))
        situation = situation_of(self.robot, self.state, self.leg)
        found = layers_quality(self.dem, grid, made, settings.conservative, situation, settings.quality)
        made["quality"] = np.where(found.unknown, np.nan, found.score).astype(np.float32)
        return MapStack(
            geometry=grid,
            leg=self.leg,
            stability="conservative" if settings.conservative else "plain",
            layers=made,
            provenance=Provenance(
                {"dem": self.dem.digest, "state": self.state.digest, "robot": self.robot.digest}, settings
            ),
            not_lifted=not_lifted,
        )

    def _of_ground(self, stride: int) -> dict[str, NDArray[np.generic]]:
        """What the ground alone says, whatever the leg reaches."""
        made: dict[str, NDArray[np.generic]] = {
            name: np.ascontiguousarray(getattr(self.ground, name)[::stride, ::stride])
            for name in ("goodness", "certainty", "slope", "roughness", "step")
        }
        return made | {name: cells[::stride, ::stride] for name, cells in memory_layers(self.dem).items()}


def _every(grid: GridGeometry, stride: int) -> GridGeometry:
    """The grid of every ``stride``-th cell, from the first on."""
    return GridGeometry(grid.x0, grid.y0, stride * grid.resolution, -(-grid.rows // stride), -(-grid.cols // stride))


def memory_layers(dem: Dem) -> dict[str, NDArray[np.float32]]:
    """Layers "age" [s] and "height_sd" [m] of each cell, (rows, cols); NaN where the terrain doesn't say."""
    nothing = np.full(dem.geometry.shape, np.nan, np.float32)
    deviation = nothing if dem.variance is None else np.sqrt(dem.variance)
    return {"age": ages(dem), "height_sd": deviation}
