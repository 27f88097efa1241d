"""How good a footfall every cell would be: hard constraints refuse, weighted factors rank what is left.

A *constraint* (known ground, range, posture, collision, stability, elevation) is passed or not. The score of what
passes is the weighted geometric mean of the factors (``maps.quality_settings``),

    score = ∏ fᵢ^(wᵢ / Σw),

so that a factor at 0 is a veto that no other can buy off (in an arithmetic mean it could), equal factors give just that
score, and only the proportions of the weights count.

References:
----------
C. Caillas, M. Hebert, E. Krotkov, I. Kweon, T. Kanade, "Methods for identifying footfall positions for a legged
robot", IROS 1989. J. Bares, W. Whittaker, "Configuration of autonomous walkers for extreme terrain", Int. J. Robotics
Research 12 (6), 1993. E. Krotkov, R. Simmons, "Perception, planning, and control for autonomous walking with the
Ambler planetary rover", Int. J. Robotics Research 15 (2), 1996: constraints first, then a weighted choice.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.core.grid import GridGeometry
from footfall.maps import layers as footing
from footfall.maps import reach_classes
from footfall.maps.quality_settings import FACTORS, QualitySettings, factor_of
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState

Layers = Mapping[str, NDArray[Any]]
"""Layers on one grid, (rows, cols) each, named as in ``maps.layers``, and "height" [m, site], "support" (share of the
wheel's footprint that carries), "limit_margin" [rad, to the nearest joint limit] and "reach_class"
(``maps.reach_classes``). "height" and one of "reach_class" and "footing" are needed."""

RANGE, UNKNOWN, POSTURE, COLLISION, UNSURE, UNSTABLE, ELEVATION, LIMIT, NO_LIFT_OFF = range(1, 10)
REFUSALS: Mapping[int, tuple[str, str]] = MappingProxyType(
    {
        RANGE: ("out of reach", "move the body nearer, or choose another leg"),
        UNKNOWN: ("not known well enough", "look there with the cameras, or allow unknown ground"),
        POSTURE: ("without a posture inside the joint limits", "change the body's height, tilt or place"),
        COLLISION: ("in collision", "change the body's height or place, or choose another leg"),
        UNSURE: ("not cleared of collisions", "let the plan check it, or accept cells that are not cleared"),
        UNSTABLE: ("not stable", "shift the body away from the leg, or set another leg down better first"),
        ELEVATION: ("too high or too low for the body", "change the body's height, or widen the elevation band"),
        LIMIT: ("at or beyond the limit of a factor", "widen that limit, or set the factor's weight to 0"),
        NO_LIFT_OFF: ("for a leg that can't be lifted", "choose another leg, or change the stance first"),
    }
)
"""Why a cell is refused, in the order of the checks: what it is, and what to try."""


@dataclass(frozen=True)
class LegSituation:
    """Of the leg that asks, in site.

    hip: of the hip-yaw joint [m]; foot: its present contact [m]; length: farthest that a contact can be from the hip
    [m]; towards: (east, north) in which the body is to advance, of any length above zero, or None.
    """

    hip: tuple[float, float, float]
    foot: tuple[float, float, float]
    length: float
    towards: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name, size in (("hip", 3), ("foot", 3)):
            if np.shape(getattr(self, name)) != (size,) or not np.isfinite(getattr(self, name)).all():
                raise InvalidInput(f"{name} needs {size} finite coordinates [m]")
        if not 0 < self.length < np.inf:
            raise InvalidInput("the leg's length must be above zero [m]", length=self.length)
        towards = self.towards
        if towards is not None and not (np.shape(towards) == (2,) and 0 < np.hypot(*towards) < np.inf):
            raise InvalidInput("a goal direction needs two finite numbers (east, north), not both 0", towards=towards)


def situation_of(robot: Robot, state: RobotState, leg: int, towards: tuple[float, float] | None = None) -> LegSituation:
    """The situation of one leg.

    Args:
        robot: the rover.
        state: how the rover stands.
        leg: number of the leg, from 0.
        towards: (east, north) in which the body is to advance; None: nowhere.

    Returns:
        Hip, foot and length of the leg, in site.

    Raises:
        InvalidInput: the rover has no such leg.
    """
    leg = robot.require_leg(leg)
    hip = apply(state.T_site_base, robot.description.legs[leg].T_base_hip[:3, 3])
    wheel = apply(state.T_site_base, wheel_centers(robot, state.posture)[leg])
    x, y, z = (float(one) for one in wheel - [0.0, 0.0, robot.wheel_radius])
    return LegSituation((float(hip[0]), float(hip[1]), float(hip[2])), (x, y, z), robot.leg_length(leg), towards)


@dataclass(frozen=True)
class Quality:
    """What was asked (geometry, layers, situation, settings) and the answer.

    score: (rows, cols) 0…1, 0 where refused; refused: (rows, cols) uint8, 0 or a key of REFUSALS.
    unknown: (rows, cols) whether the ground there is unknown. counted: factors in the score.
    left_out: the others → why.
    """

    geometry: GridGeometry
    layers: Layers
    situation: LegSituation
    settings: QualitySettings
    score: Array
    refused: NDArray[np.uint8]
    unknown: NDArray[np.bool_]
    counted: tuple[str, ...]
    left_out: Mapping[str, str]

    def amounts(self, cells: NDArray[np.int64]) -> dict[str, Array]:
        """Of every counted factor, what it measures at ``cells`` (n,), flat indices, in its unit; NaN = unknown."""
        return {name: _amounts(name, self.geometry, self.layers, self.situation, cells) for name in self.counted}


def quality(geometry: GridGeometry, layers: Layers, situation: LegSituation, settings: QualitySettings) -> Quality:
    """Score every cell of the grid.

    A limit's factor that is unknown at a cell makes its ground unknown; a preference's counts as PREFERENCE_LEAST.
    Raises InvalidInput for a layer that does not fit the grid, is needed and missing, or holds an unknown class.
    """
    _check(geometry, layers)
    counted, left_out = _sorted_out(layers, situation, settings)
    refused, unknown = _constraints(geometry, layers, situation, settings)
    cells = np.flatnonzero(refused == 0)
    total = sum(settings.weights[name] for name in counted)
    log_score = np.zeros(cells.size)
    missing = np.zeros(cells.size, bool)
    for name in counted:
        amount = _amounts(name, geometry, layers, situation, cells)
        if FACTORS[name].limit:
            missing |= np.isnan(amount)
        with np.errstate(divide="ignore"):  # the log of a veto
            log_score += settings.weights[name] / total * np.log(factor_of(name, amount, settings))
    score = np.zeros(geometry.shape)
    score.flat[cells] = np.exp(log_score)
    refused.flat[cells[log_score == -np.inf]] = LIMIT
    unknown.flat[cells[missing]] = True
    if not settings.allow_unknown:
        refused.flat[cells[missing]] = UNKNOWN
        score.flat[cells[missing]] = 0.0
    return Quality(geometry, layers, situation, settings, score, refused, unknown, counted, left_out)


def _amounts(
    name: str, geometry: GridGeometry, layers: Layers, situation: LegSituation, cells: NDArray[np.int64]
) -> Array:
    if name != "advance":
        return np.asarray(layers[name]).reshape(-1)[cells].astype(np.float64)
    towards = np.array(situation.towards, float)
    east, north = towards / np.hypot(*towards)
    along_x, along_y = east * (geometry.xs - situation.foot[0]), north * (geometry.ys - situation.foot[1])
    return along_x[cells % geometry.cols] + along_y[cells // geometry.cols]


def _check(geometry: GridGeometry, layers: Layers) -> None:
    if "height" not in layers or not ("reach_class" in layers or "footing" in layers):
        raise InvalidInput(
            'footfalls need the layer "height" and one of "reach_class" and "footing"', given=sorted(layers)
        )
    for name, layer in layers.items():
        if np.shape(layer) != geometry.shape or np.asarray(layer).dtype.kind not in "biuf":
            raise InvalidInput(
                f"layer {name!r} needs one number for each cell of the grid {geometry.shape}, "
                f"it is {np.asarray(layer).dtype} {np.shape(layer)}"
            )
    for name, known in (("reach_class", _BY_REACH_CLASS), ("footing", _BY_FOOTING)):
        if name in layers:
            layer = np.asarray(layers[name])
            if layer.dtype.kind not in "iu" or layer.min() < 0 or layer.max() >= len(known):
                raise InvalidInput(f"layer {name!r} holds whole numbers from 0 to {len(known) - 1}")


def _sorted_out(
    layers: Layers, situation: LegSituation, settings: QualitySettings
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Factors that count, and why each of the others doesn't."""
    left_out = {}
    for name in FACTORS:
        if settings.weights[name] == 0:
            left_out[name] = "its weight is 0"
        elif name == "advance":
            if situation.towards is None:
                left_out[name] = "no goal direction is given"
        elif name not in layers:
            left_out[name] = "no such layer is given"
        elif np.isnan(layers[name]).all():
            left_out[name] = "it is not known anywhere"
    counted = tuple(name for name in FACTORS if name not in left_out)
    if not counted:
        raise InvalidInput("no factor with a weight above 0 is known", left_out=left_out)
    return counted, left_out


def _classes(known: Mapping[int, int], count: int) -> NDArray[np.uint8]:
    return np.array([known.get(code, 0) for code in range(count)], np.uint8)


_BY_REACH_CLASS = _classes(
    {
        reach_classes.UNKNOWN: UNKNOWN,
        reach_classes.OUT_OF_RANGE: RANGE,
        reach_classes.NO_GEOMETRY: POSTURE,
        reach_classes.JOINT_LIMIT: POSTURE,
        reach_classes.NO_LIFT: POSTURE,
        reach_classes.FOOT_COLLISION: COLLISION,
        reach_classes.WAYPOINT_COLLISION: COLLISION,
        reach_classes.UNSURE: UNSURE,
        reach_classes.NOT_LIFTED: NO_LIFT_OFF,
    },
    len(reach_classes.CLASSES),
)
_BY_FOOTING = _classes(
    {
        footing.UNKNOWN: UNKNOWN,
        footing.OUT_OF_RANGE: RANGE,
        footing.NO_SOLUTION: POSTURE,
        footing.REACHABLE_UNSTABLE: UNSTABLE,
        footing.COLLISION: COLLISION,
        footing.UNSURE: UNSURE,
        footing.NOT_LIFTED: NO_LIFT_OFF,
    },
    8,
)


def _constraints(
    geometry: GridGeometry, layers: Layers, situation: LegSituation, settings: QualitySettings
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """The first constraint that each cell breaks (0: none), and which cells' ground is unknown, (rows, cols) each."""
    east, north = geometry.xs - situation.hip[0], geometry.ys - situation.hip[1]
    height = np.asarray(layers["height"]) - situation.hip[2]
    unknown = np.isnan(height)
    given = [
        table[np.asarray(layers[name])]
        for name, table in (("reach_class", _BY_REACH_CLASS), ("footing", _BY_FOOTING))
        if name in layers
    ]
    for one in given:
        unknown |= one == UNKNOWN
    refused = np.zeros(geometry.shape, np.uint8)
    # last check first, so that the first one broken has the last word
    refused[(height < settings.lowest) | (height > settings.highest)] = ELEVATION
    for code in (UNSTABLE, UNSURE, COLLISION, POSTURE, NO_LIFT_OFF):
        if code != UNSURE or not settings.accept_unsure:
            for one in given:
                refused[one == code] = code
    if not settings.allow_unknown:
        refused[unknown] = UNKNOWN
    for one in given:
        refused[one == RANGE] = RANGE
    away = east**2 + (north**2)[:, None] + np.where(np.isnan(height), 0.0, height) ** 2
    refused[away > situation.length**2] = RANGE
    return refused, unknown
