"""Planning one step: open ground, obstructed steps by every planner on the same problems; then what a first plan costs,
the problem set with its peers, and the recheck of accepted paths (benchmarks/steps).

Times are processor time on one thread: other programs add little to them. Plans are of a stance and a ground that
were planned on before; what that saves is in the rows of new scenes.
"""

import time
from collections.abc import Iterator

import numba
import numpy as np

import footfall
from benchmarks.scenes import robot, rocks, standing
from benchmarks.steps import figures as problem_set
from benchmarks.steps import first_look, recheck
from benchmarks.steps.quality import swing
from benchmarks.steps.search import raw_search
from benchmarks.timing import SEED, Figure
from footfall.core.frames import apply
from footfall.maps.layers import REACHABLE_STABLE
from footfall.planning.answers import Status
from footfall.planning.scene.ground import Nearby
from footfall.planning.step.footing import LegStance, ground_near
from footfall.planning.step.problem import PlanResult, StepSettings
from footfall.planning.step.situation import Situation
from footfall.robot.kinematics import wheel_centers
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import plane


def targets(dem: Dem, state: RobotState, count: int) -> list[tuple[int, float, float]]:
    """Seeded footfalls that the leg reaches and stands stably on, 0.2 to 0.6 m from where its foot is: (leg, x, y)."""
    rng = np.random.default_rng(SEED)
    wheels = apply(state.T_site_base, wheel_centers(robot(), state.posture))
    x, y = np.moveaxis(dem.geometry.centers(), -1, 0)
    choices = {}
    for leg in robot().legs:
        footing = np.asarray(footfall.compute_maps(robot(), dem, state, leg=leg).layers["footing"])
        away = np.hypot(x - wheels[leg, 0], y - wheels[leg, 1])
        choices[leg] = np.flatnonzero((footing == REACHABLE_STABLE) & (away >= 0.2) & (away <= 0.6))
    out = []
    able = [leg for leg, cells in choices.items() if len(cells)]
    for _ in range(count):
        leg = int(rng.choice(able))
        cell = int(rng.choice(choices[leg]))
        out.append((leg, float(x.flat[cell]), float(y.flat[cell])))
    return out


def timed(dem: Dem, state: RobotState, problem: tuple[int, float, float], planner: str) -> tuple[float, PlanResult]:
    leg, x, y = problem
    begin = time.process_time()
    result = footfall.plan_step(
        robot(), dem, state, leg=leg, target=(x, y), settings=StepSettings(planner=planner, seed=1, time_limit=20.0)
    )
    return time.process_time() - begin, result


def obstructed(dem: Dem, state: RobotState, count: int) -> list[tuple[int, float, float]]:
    """Footfalls of :func:`targets` that a straight swing does not reach, but another planner does."""
    found = []
    for problem in targets(dem, state, 12 * count):
        plan = timed(dem, state, problem, "auto")[1].plan
        if plan is not None and plan.planner != "line":
            found.append(problem)
    return found[:count]


def raw(dem: Dem, state: RobotState, problem: tuple[int, float, float]) -> float | None:
    """Seconds of the compiled search alone, between the lifted ends of an obstructed step; None where it finds none."""
    leg = problem[0]
    plan, ground = timed(dem, state, problem, "auto")[1].plan, ground_near(LegStance(robot(), dem, state, leg))
    if plan is None or not isinstance(ground, Nearby):
        return None
    path = swing(plan)
    situation = Situation(robot(), dem, state, leg, ground, StepSettings()).for_swing(path[0], path[-1])
    raw_search(situation, path[0], path[-1], 1)  # prepares what the meshes near unsure ends need
    return raw_search(situation, path[0], path[-1], 1)


def figures(quick: bool) -> Iterator[Figure]:
    count = 4 if quick else 16
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    flat = plane(size=8.0, resolution=0.02)
    on_flat = footfall.stand(robot(), flat)
    open_targets = targets(flat, on_flat, count)
    for problem in open_targets:
        timed(flat, on_flat, problem, "auto")
    yield from _found("step.open_ground", [timed(flat, on_flat, p, "auto") for p in open_targets], 0.005, 0.015)
    problems = obstructed(rocks(), standing(), count)
    times = tuple(t for t in (raw(rocks(), standing(), p) for p in problems) if t is not None)
    yield Figure("step.obstructed_raw", times, "s", 0.003, p95_at_most=0.01)
    certified = [timed(rocks(), standing(), p, "fast") for p in problems]
    yield from _found("step.obstructed_certified", certified, 0.015, 0.05)
    for planner in ("astar", "sbl", "rrtconnect"):
        timed(rocks(), standing(), problems[0], planner)  # loads what only this search needs
        yield from _found(f"step.obstructed_{planner}", [timed(rocks(), standing(), p, planner) for p in problems])
    yield from first_look.figures(quick)
    yield from problem_set.figures(quick)
    yield from recheck.figures(quick)
    numba.set_num_threads(threads)


def _found(
    name: str, results: list[tuple[float, PlanResult]], floor: float | None = None, p95: float | None = None
) -> Iterator[Figure]:
    times = tuple(seconds for seconds, result in results if result.status is Status.FOUND)
    yield Figure(f"{name}_found", (len(times) / len(results),), "share")
    if times:
        yield Figure(name, times, "s", floor, p95_at_most=p95)
