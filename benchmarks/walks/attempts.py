"""One walk that is asked for and what came of it: from where the rover stands, straight ahead, its heading kept."""

import time

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.walks.rappel import hanging
from benchmarks.walks.summary import Attempt
from benchmarks.walks.terrains import FAMILIES, slopes, start_of, terrain
from footfall.balance.tether import Tether
from footfall.core.errors import InvalidInput
from footfall.planning.walk.plan import plan_walk
from footfall.planning.walk.problem import WalkGoal, WalkPlan, WalkSettings
from footfall.planning.walk.recheck.walk import recheck_walk
from footfall.planning.walk.smoothing import Smoothing
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

POSTURES = ("stand", "crouch", "tall")
"""A walk starts in the first of these that the rover can stand in at its place."""
SMOOTHING = Smoothing()


def attempt(
    family: str,
    number: int,
    seed: int,
    metres: float = 2.75,
    limit: float = 60.0,
    recheck: bool = False,
    smoothing: Smoothing = SMOOTHING,
) -> Attempt:
    """The walk of so many metres on the terrain of a family and number; limit: of wall clock [s]."""
    dem, (x, y) = terrain(family, number, metres), start_of(metres)
    slope, tether, yaw = slopes(dem), None, 0.0
    if FAMILIES[family].incline:
        tether, (x, y), end, yaw = hanging(dem, family, metres)
        state = _on_tether(dem, x, y, yaw, tether)
    else:
        state, end = _standing(dem, x, y), (x + metres, y)
    if isinstance(state, str):
        return Attempt(family, number, seed, "no start", state, slope=slope)
    goal, settings = WalkGoal(*end, yaw), WalkSettings(time_limit=limit, smoothing=smoothing)
    begun, worked = time.perf_counter(), time.process_time()
    result = plan_walk(robot(), dem, state, goal, seed=seed, settings=settings, tether=tether)
    took = time.perf_counter() - begun, time.process_time() - worked
    walk = result.plan or result.partial
    if walk is None:
        return Attempt(family, number, seed, result.status.value, result.reason, *took, slope=slope)
    found = (walk.foot_moves, walk.chassis_way, float(np.min(walk.margins)), float(np.max(walk.torques)))
    failed, rechecked = None, float("nan")
    if recheck:
        begun = time.perf_counter()
        checks = recheck_walk(robot(), dem, _asked(walk, goal), settings, state=state)
        rechecked = time.perf_counter() - begun
        failed = tuple(
            f"{one.name} by {-one.margin:.3g} {one.unit} ({one.where})"
            for one in checks
            # a walk that comes near the goal is good as far as it goes
            if not one.holds and not (one.name == "goal" and result.plan is None)
        )
    smoothed = result.smoothed
    came = (result.status.value, result.reason, *took, *found, slope, failed, rechecked)
    return Attempt(family, number, seed, *came, smoothed and smoothed.before, smoothed and smoothed.after)


def _standing(dem: Dem, x: float, y: float) -> RobotState | str:
    """The rover at a place in one of POSTURES; why it can't stand in the first of them where it can't in any."""
    refusals = []
    for posture in POSTURES:
        try:
            return footfall.stand(robot(), dem, x, y, posture=posture)
        except InvalidInput as no:
            refusals.append(str(no))
    return refusals[0]


def _on_tether(dem: Dem, x: float, y: float, yaw: float, tether: Tether) -> RobotState | str:
    """The rover hanging on its tether at a place; why it can't."""
    try:
        return footfall.stand(robot(), dem, x, y, yaw, tether=tether)
    except InvalidInput as no:
        return str(no)


def _asked(plan: WalkPlan, goal: WalkGoal) -> WalkPlan:
    """The plan, held against the goal that was asked for, whatever it says itself."""
    fields = {name: getattr(plan, name) for name in WalkPlan.__dataclass_fields__}
    return WalkPlan(**{**fields, "goal": goal})
