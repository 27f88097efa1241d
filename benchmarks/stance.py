"""Moving the chassis: the smallest shift for seeded footfalls that the rover can't step onto as it stands."""

import time
from collections.abc import Iterator

import numpy as np
from scipy.ndimage import distance_transform_edt

import footfall
from benchmarks.scenes import robot, rocks, standing
from benchmarks.timing import SEED, Figure, seconds
from footfall.core.frames import apply
from footfall.planning.answers import No, Status
from footfall.planning.body.body_shift import ShiftRefused
from footfall.planning.body.find_problem import FindShiftSettings, ShiftResult
from footfall.planning.scene.ground import footfall_contact
from footfall.planning.step.problem import StepSettings
from footfall.robot.kinematics import wheel_centers

BEYOND = (0.05, 0.30)
"""How far footfalls out of reach lie from the nearest place where the leg can stand without a shift [m]."""
CAUTIOUS = FindShiftSettings(conservative=True, least_margin=0.05)
"""With a leg in the air the loss of another may not tip the rover: as it stands, most steps fail that."""
Target = tuple[int, float, float]


def targets(count: int, beyond: tuple[float, float]) -> list[Target]:
    """Seeded footfalls (leg, x, y) on passable, known ground, so far [m] from where the leg stands stably."""
    rng = np.random.default_rng(SEED)
    x, y = np.moveaxis(rocks().geometry.centers(), -1, 0)
    wheels = apply(standing().T_site_base, wheel_centers(robot(), standing().posture))
    nearest = np.argmin(np.hypot(x[..., None] - wheels[:, 0], y[..., None] - wheels[:, 1]), axis=-1)
    choices = []
    for leg in robot().legs:
        layers = footfall.compute_maps(robot(), rocks(), standing(), leg=leg).layers
        with np.errstate(invalid="ignore"):
            stable = (np.asarray(layers["solutions"], float) > 0) & (np.asarray(layers["margin"], float) > 0)
            passable = np.asarray(layers["goodness"], float) >= 0.5
        away = np.asarray(distance_transform_edt(~stable)) * rocks().geometry.resolution
        wheel_away = np.hypot(x - wheels[leg, 0], y - wheels[leg, 1])
        chosen = (away >= beyond[0]) & (away <= beyond[1]) & passable & (nearest == leg) & (wheel_away >= 0.2)
        choices.append(np.flatnonzero(chosen))
    out: list[Target] = []
    while len(out) < count:
        leg = int(rng.integers(len(choices)))
        if len(choices[leg]):
            cell = int(rng.choice(choices[leg]))
            target = (leg, float(x.flat[cell]), float(y.flat[cell]))
            if not isinstance(footfall_contact(robot(), rocks(), *target[1:]), No):
                out.append(target)
    return out


def figures(quick: bool) -> Iterator[Figure]:
    count = 6 if quick else 30
    far = [(target, FindShiftSettings()) for target in targets(count, BEYOND)]
    cautious = [(target, CAUTIOUS) for target in targets(count // 3, (0.0, 0.0))]
    _asked(*far[0])
    answers = {"out_of_reach": [_asked(*one) for one in far], "unstable": [_asked(*one) for one in cautious]}
    yield Figure("stance.find_shift", tuple(s for part in answers.values() for s, _ in part), "s", floor=1.0)
    found: list[tuple[Target, FindShiftSettings, ShiftResult]] = []
    for (name, part), asked in zip(answers.items(), (far, cautious), strict=True):
        yes = [result.status is Status.FOUND for _, result in part]
        yield Figure(f"stance.find_shift_answered_{name}", (sum(yes) / len(yes),), "share")
        found += [(*one, result) for one, (_, result), good in zip(asked, part, yes, strict=True) if good]
    yield Figure("stance.find_shift_cost", tuple(result.cost for _, _, result in found), "m")
    steps = [_step_after(*one) for one in found]
    yield Figure("stance.step_possible_after_shift", (sum(s[0] for s in steps) / len(steps),), "share", 1.0, False)
    yield Figure("stance.step_planned_after_shift", (sum(s[1] for s in steps) / len(steps),), "share")
    moves = [result.plan.shift for _, _, result in found if result.plan is not None][: count // 3]
    n = 1 if quick else 3
    for name, call in (("shifted_state", footfall.shifted_state), ("plan_body_move", footfall.plan_body_move)):
        taken = [min(seconds(lambda c=call, m=m: c(robot(), rocks(), standing(), m), n)) for m in moves]
        yield Figure(f"stance.{name}", tuple(taken), "s")


def _asked(target: Target, settings: FindShiftSettings) -> tuple[float, ShiftResult]:
    leg, x, y = target
    begin = time.perf_counter()
    result = footfall.find_shift(robot(), rocks(), standing(), leg, (x, y), settings)
    return time.perf_counter() - begin, result


def _step_after(target: Target, settings: FindShiftSettings, result: ShiftResult) -> tuple[bool, bool]:
    """Whether the step planner, asked anew, accepts start and goal after the shift, and whether it finds a way."""
    leg, x, y = target
    state = footfall.shifted_state(robot(), rocks(), standing(), result.shift or footfall.BodyShift())
    if isinstance(state, ShiftRefused):
        return False, False
    step = StepSettings(conservative=settings.conservative, least_margin=settings.least_margin, seed=1, time_limit=20.0)
    answer = footfall.plan_step(robot(), rocks(), state, leg=leg, target=(x, y), settings=step)
    refused = answer.status in (Status.START_INVALID, Status.GOAL_INVALID) or "can't be lifted" in answer.reason
    return not refused, answer.status is Status.FOUND
