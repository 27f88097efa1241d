"""How the rover sags: time of a solve, and what each wrong input costs the prediction.

The truth is the static model itself with the right inputs, after some steps that leave the legs strained against each
other; so the errors are those of the inputs alone. An error is how far the chassis' origin, or the lifted wheel's hub,
ends from where it truly is. Executions are of seeded steps; touch-downs are also where a truth that differs from what
they were made for puts the wheel down.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

import footfall
from benchmarks.scenes import robot
from benchmarks.step import targets
from benchmarks.timing import SEED, Figure
from footfall.balance.balance_settings import BalanceSettings
from footfall.planning.answers import Status
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.compliance.predict import advanced, predict
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings
from footfall.planning.execution.plan import plan_execution
from footfall.planning.execution.problem import Execution
from footfall.planning.scene.lift import vertical
from footfall.robot.kinematics import leg_wheel_pose
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal

TRUE = ComplianceSettings(balance=BalanceSettings(payload_mass=100.0))
TILT = np.radians(8.0)
ENCODER = np.radians(0.3)


@dataclass(frozen=True)
class Lift:
    """A commanded lift: set points before and after, what telemetry says before, and where the rover truly ends."""

    leg: int
    before: RestingRover
    state: RobotState
    commanded: np.ndarray
    after: RestingRover


def lifts(ground: Dem, count: int) -> list[Lift]:
    """Seeded lifts of 10 to 25 cm; each starts after lifts and puttings down of two other legs."""
    rng = np.random.default_rng(SEED)
    rover = CompliantRover(robot(), ground, TRUE)
    stood = footfall.stand(robot(), ground)
    first = rover.let_down(stood.posture, stood.T_site_base)
    out = []
    while len(out) < count:
        legs = rng.permutation(robot().leg_count)[:3]
        rest = first
        for leg in legs[:2]:
            rest = advanced(rover, rest, raised(rest, int(leg), 0.3))
            back = rest.commanded.copy()
            back[6 * leg : 6 * leg + 6] = first.commanded[6 * leg : 6 * leg + 6] + rng.normal(0.0, 0.01, 6)
            rest = advanced(rover, rest, back)
        leg = int(legs[2])
        commanded = raised(rest, leg, float(rng.uniform(0.10, 0.25)))
        end = advanced(rover, rest, commanded)
        if rest.settled and end.settled:
            out.append(Lift(leg, rest, rover.state(rest), commanded, end))
    return out


def raised(rest: RestingRover, leg: int, height: float) -> np.ndarray:
    """Set points that lift a wheel by so much [m] if nothing gave way."""
    own = slice(6 * leg, 6 * leg + 6)
    up = vertical(robot(), leg, rest.T_site_base, rest.commanded[own], height)
    if isinstance(up, str):
        raise RuntimeError(up)
    out = rest.commanded.copy()
    out[own] = up[-1]
    return out


def errors(lift: Lift, end: RestingRover) -> tuple[float, float]:
    """Of the chassis' origin and of the wheel's hub [m]; NaN where the prediction found no equilibrium."""
    if not end.settled:
        return float("nan"), float("nan")
    chassis = np.linalg.norm(end.T_site_base[:3, 3] - lift.after.T_site_base[:3, 3])
    return float(chassis), float(np.linalg.norm(end.hubs[lift.leg] - lift.after.hubs[lift.leg]))


def predicted(
    ground: Dem, settings: ComplianceSettings, lift: Lift, state: RobotState | None = None
) -> tuple[float, float]:
    rover = CompliantRover(robot(), ground, settings)
    start = measured(rover, state or lift.state, lift.before.commanded)
    return errors(lift, advanced(rover, start, lift.commanded))


def without_forces(lift: Lift) -> RobotState:
    return replace(lift.state, wheel_forces=np.zeros_like(lift.state.wheel_forces))


def encoders(lift: Lift, index: int) -> RobotState:
    noise = np.random.default_rng((SEED, index)).normal(0.0, ENCODER, len(lift.state.posture))
    return replace(without_forces(lift), posture=lift.state.posture + noise)


def from_scratch(ground: Dem, lift: Lift) -> tuple[float, float]:
    """Let down anew in the posture commanded before, on the wheels as they stand, rather than measured."""
    rover = CompliantRover(robot(), ground, TRUE)
    hubs = np.array([leg_wheel_pose(robot(), lift.before.commanded[6 * i : 6 * i + 6], i)[:3, 3] for i in robot().legs])
    R = lift.state.T_site_base[:3, :3]
    T = np.array(lift.state.T_site_base)
    T[:3, 3] = (lift.before.rims - hubs @ R.T).mean(axis=0)
    return errors(lift, advanced(rover, rover.let_down(lift.before.commanded, T), lift.commanded))


def tilted(ground: Dem, lift: Lift) -> Dem:
    """The ground with normals wrong by TILT: turned about each wheel, whose height it keeps."""
    grid = ground.geometry
    cells, hubs = grid.centers()[:, :, None], lift.before.hubs[:, :2]
    nearest = np.argmin(np.linalg.norm(cells - hubs, axis=-1), axis=-1)
    slope = np.tan(TILT) * (cells[:, :, 0, 0] - hubs[nearest, 0])
    return from_heights((ground.heights + slope).astype(np.float32), grid.resolution, grid.x0, grid.y0)


def wrong_inputs(ground: Dem) -> dict[str, Callable[[Lift, int], tuple[float, float]]]:
    """name → errors [m] of the prediction of a lift with that input wrong."""

    def with_settings(settings: ComplianceSettings) -> Callable[[Lift, int], tuple[float, float]]:
        return lambda lift, _: predicted(ground, settings, lift)

    return {
        "nothing": with_settings(TRUE),
        "nothing_but_no_wheel_forces": lambda lift, _: predicted(ground, TRUE, lift, without_forces(lift)),
        "not_from_telemetry": lambda lift, _: from_scratch(ground, lift),
        "payload_100_kg_ignored": with_settings(ComplianceSettings()),
        "joints_20_percent_softer": with_settings(replace(TRUE, joint_scale=0.8)),
        "wheels_30_percent_softer": with_settings(replace(TRUE, wheel_scale=0.7)),
        "wheels_10_times_stiffer": with_settings(replace(TRUE, wheel_scale=10.0)),
        "no_rolling": with_settings(replace(TRUE, rolling=False)),
        "friction_0.3_for_0.6": with_settings(replace(TRUE, balance=replace(TRUE.balance, friction=0.3))),
        "normals_8_deg": lambda lift, _: predicted(tilted(ground, lift), TRUE, lift),
        "encoders_0.3_deg": lambda lift, index: predicted(ground, TRUE, lift, encoders(lift, index)),
    }


def figures(quick: bool) -> Iterator[Figure]:
    count = 5 if quick else 30
    ground = fractal(size=8.0, resolution=0.05, roughness=0.01, seed=SEED)
    problems = lifts(ground, count)
    rover = CompliantRover(robot(), ground, TRUE)
    times = []
    for lift in problems:
        nearly = lift.before.commanded + 0.05 / np.abs(lift.commanded - lift.before.commanded).max() * (
            lift.commanded - lift.before.commanded
        )
        begin = time.process_time()
        rover.after(lift.before, nearly)
        times.append(time.process_time() - begin)
    yield Figure("compliance.solve_of_5_cm", tuple(times), "s", 0.005)
    rises = tuple(float((lift.after.hubs - lift.before.hubs)[lift.leg, 2] / lift_height(lift)) for lift in problems)
    yield Figure("compliance.rise_of_commanded_lift", rises, "share")
    stuck = tuple(float(lift.after.touching[lift.leg]) for lift in problems)
    yield Figure("compliance.lifts_that_stay_on_ground", (sum(stuck) / len(stuck),), "share")
    for name, cost in wrong_inputs(ground).items():
        costs = np.array([cost(lift, i) for i, lift in enumerate(problems)])
        yield Figure(f"compliance.wrong.{name}.chassis", tuple(costs[:, 0]), "m")
        yield Figure(f"compliance.wrong.{name}.wheel", tuple(costs[:, 1]), "m")
    yield from execution_figures(ground, count)


def execution_figures(ground: Dem, count: int) -> Iterator[Figure]:
    """Steps commanded in each mode: time, how many are found, and touch-downs, also of rovers that are other ones."""
    rover = CompliantRover(robot(), ground)
    stood = footfall.stand(robot(), ground)
    rest = rover.let_down(stood.posture, stood.T_site_base)
    state = rover.state(rest)
    plans = []
    for leg, x, y in targets(ground, stood, count):
        result = footfall.plan_step(robot(), ground, state, leg, (x, y))
        plans += [result.plan] if result.plan is not None else []
    others = {
        "softer": ComplianceSettings(0.8, 0.7),
        "stiffer_and_heavier": ComplianceSettings(1.2, 1.3, balance=BalanceSettings(payload_mass=40.0)),
    }
    for mode in MODES:
        settings, times, found = ExecutionSettings(mode=mode), [], []
        plan_execution(robot(), ground, state, plans[0], settings, rest.commanded)
        for plan in plans:
            begin = time.process_time()
            result = plan_execution(robot(), ground, state, plan, settings, rest.commanded)
            times.append(time.process_time() - begin)
            if result.status is Status.FOUND and result.execution is not None:
                found.append(result.execution)
        yield Figure(f"execution.{mode}.found", (len(found) / len(plans),), "share")
        yield Figure(f"execution.{mode}", tuple(times), "s")
        yield Figure(f"execution.{mode}.step_takes", tuple(one.seconds for one in found), "s")
        yield Figure(f"execution.{mode}.touch_down", tuple(one.touch_down_offset for one in found), "m")
        for name, truth in others.items():
            off = tuple(touch_down(CompliantRover(robot(), ground, truth), state, rest.commanded, one) for one in found)
            yield Figure(f"execution.{mode}.touch_down_{name}", off, "m")


def touch_down(truth: CompliantRover, state: RobotState, commanded: np.ndarray, done: Execution) -> float:
    """How far from the planned contact another rover puts the wheel down [m]; NaN where it never touches."""
    motion = predict(truth, measured(truth, state, commanded, fitted=False), done.commanded[1:])
    for rest in motion.rests[done.guarded_from :]:
        if rest.touching[done.leg]:
            return float(np.linalg.norm((rest.contacts[done.leg] - done.plan.contact)[:2]))
    return float("nan")


def lift_height(lift: Lift) -> float:
    """Commanded rise of the wheel if nothing gave way [m]."""
    own = slice(6 * lift.leg, 6 * lift.leg + 6)
    centers = [leg_wheel_pose(robot(), q[own], lift.leg)[:3, 3] for q in (lift.before.commanded, lift.commanded)]
    return float((lift.before.T_site_base[:3, :3] @ (centers[1] - centers[0]))[2])


def main() -> None:
    """Print every figure."""
    for figure in figures(quick=False):
        row = figure.as_dict()
        print(f"{figure.name:<52}{row['median']:>12.4g}{row['p95']:>12.4g}  {figure.unit:<6}{row['n']:>4}", flush=True)


if __name__ == "__main__":
    main()
