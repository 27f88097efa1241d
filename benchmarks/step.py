"""Planning one step: open ground, and obstructed steps by every planner on the same problems."""

import time
from collections.abc import Iterator

import numpy as np

import footfall
from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import SEED, Figure
from footfall.core.frames import apply
from footfall.maps.layers import REACHABLE_STABLE
from footfall.planning.step.problem import PlanResult, Status, StepSettings
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


def timed(dem, state, problem: tuple[int, float, float], planner: str) -> tuple[float, PlanResult]:
    leg, x, y = problem
    begin = time.perf_counter()
    result = footfall.plan_step(
        robot(), dem, state, leg=leg, target=(x, y), settings=StepSettings(planner=planner, seed=1, time_limit=20.0)
    )
    return time.perf_counter() - begin, result


def figures(quick: bool) -> Iterator[Figure]:
    count = 4 if quick else 16
    flat = plane(size=8.0, resolution=0.02)
    on_flat = footfall.stand(robot(), flat)
    open_ground = [timed(flat, on_flat, problem, "auto") for problem in targets(flat, on_flat, count)]
    yield from _found("step.open_ground_auto", open_ground)
    problems = targets(rocks(), standing(), count)
    timed(rocks(), standing(), problems[0], "sbl")  # loads what only the searches need
    runs = {
        planner: [timed(rocks(), standing(), p, planner) for p in problems]
        for planner in ("auto", "line", "astar", "sbl", "rrtconnect")
    }
    for planner, results in runs.items():
        yield from _found(f"step.rocks_{planner}", results)
    both = [
        a[0] / b[0]
        for a, b in zip(runs["sbl"], runs["rrtconnect"], strict=True)
        if a[1].status is Status.FOUND and b[1].status is Status.FOUND
    ]
    if both:
        yield Figure("step.rocks_sbl_over_rrtconnect", tuple(both), "ratio")


def _found(name: str, results: list[tuple[float, PlanResult]]) -> Iterator[Figure]:
    times = tuple(seconds for seconds, result in results if result.status is Status.FOUND)
    yield Figure(f"{name}_found", (len(times) / len(results),), "share")
    if times:
        yield Figure(name, times, "s")
