"""Steps planned on random ground, commanded in each mode, and judged by the rover in physics.

A step is drawn by its number: ground, gravity, payload, where the rover stands, leg and footfall, and whether the
parameters are known or physics differs from the description (joints by 20 %, wheels by 30 %, masses by 5 %, crowned
wheels, noise of the sensors). The rover in physics stands at rest; what its telemetry says is planned from. What the
planner refuses is counted, not judged. ``python -m benchmarks.referee --steps 24`` names each step that missed a floor;
``--state FILE`` keeps what each gave, so that a long run may be stopped and gone on with.
"""

import argparse
import multiprocessing
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

import footfall
from benchmarks.kept import KeptRun, digest_of
from benchmarks.steps.recheck import JUDGED as PLANNED
from benchmarks.timing import SEED, Figure, promised
from footfall.balance.balance_settings import GRAVITIES, BalanceSettings
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.answers import Status
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings
from footfall.planning.execution.plan import plan_execution
from footfall.planning.execution.problem import Execution
from footfall.planning.step.problem import StepPlan
from footfall.robot.description import with_payload
from footfall.robot.kinematics import leg_wheel_pose, wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence as Commands
from footfall.sequence.of_execution import sequence_of_execution
from footfall.sim.physics.physics_settings import Noise, PhysicsSettings
from footfall.sim.physics.referee import referee
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.verdict import RefereeReport, RefereeSettings
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal, plane, rock_field

STEPS, QUICK_STEPS = 240, 6
"""About one in ten is refused in all modes."""
GROUNDS = ("flat", "fractal", "rocks")
PAYLOAD = 300.0
NOISE = Noise(encoder=0.001, position=0.002, orientation=0.001, force=20.0)
TRIES = 40
"""Footfalls and places to stand that are tried for one step."""
CALM = 2.0
"""The rover is let stand still before its telemetry is taken [s]."""

FLOORS: dict[tuple[bool, str], dict[str, float]] = {
    (True, "as_commanded"): {"slip": 0.005, "sag": 1.0},
    (True, "droop_aware"): {"touch": 0.005, "met": 0.005, "slip": 0.002, "sag": 1.0},
    (True, "pose_held"): {"touch": 0.005, "met": 0.005, "slip": 0.002, "sag": 1.0, "chassis": 0.01},
    (False, "as_commanded"): {"slip": 0.005, "sag_chassis": 0.02, "sag_wheel": 0.03},
    (False, "droop_aware"): {"touch": 0.03, "slip": 0.005, "sag_chassis": 0.02, "sag_wheel": 0.03},
    (False, "pose_held"): {"touch": 0.03, "slip": 0.005, "sag_chassis": 0.02, "sag_wheel": 0.03, "chassis": 0.02},
}
"""Largest of each quantity of an outcome, by whether the parameters are known and by mode; none may tip or touch."""
LEAST_CLEARANCE = 0.05
JUDGED = (*PLANNED, "sequence", "sim")
"""What plans, commands and judges."""
SAG_FLOOR, SAG_SHARE = 0.003, 0.1
"""Sag may differ from the prediction by this [m], or this share of it where that is more."""


@dataclass(frozen=True)
class Case:
    """One drawn step. gravity: its name."""

    number: int
    ground: str
    gravity: str
    payload: bool
    known: bool

    def __str__(self) -> str:
        load = f"{PAYLOAD:.0f} kg" if self.payload else "empty"
        return f"{self.number} ({self.ground}, {self.gravity}, {load}, {'known' if self.known else 'unknown'})"


@dataclass(frozen=True)
class Outcome:
    """What came of a case in one mode. refused: why the planner made no execution, then all else is empty.

    tips, contacts, stayed: how often it fell, touched what it should not, or a wheel was not lifted or lowered as
    planned. touch: how far the wheel's middle is from where it was planned to stand when it touches down, seen from
    above [m]; contact: how far the point that touches is from the planned one, which on rough ground is another point
    of the wheel; met: how far it is from where it was predicted to touch; stands: as contact, at the end. slip: of the
    supporting wheels [m]. chassis: way of the chassis' origin [m]; turn: of the chassis [rad]. sag_chassis, sag_wheel:
    of the chassis' origin and the swing leg's hub at rest, from the prediction [m]; sag: over what is allowed.
    clearance: least of the swing as predicted; seen: as simulated [m]. said: the referee's words.
    """

    case: Case
    mode: str
    refused: str = ""
    tips: int = 0
    contacts: int = 0
    stayed: int = 0
    touch: float = np.nan
    contact: float = np.nan
    met: float = np.nan
    stands: float = np.nan
    slip: float = np.nan
    chassis: float = np.nan
    turn: float = np.nan
    sag_chassis: float = np.nan
    sag_wheel: float = np.nan
    sag: float = np.nan
    clearance: float = np.nan
    seen: float = np.nan
    seconds: float = np.nan
    said: tuple[str, ...] = ()

    def missed(self) -> list[str]:
        """The floors that it does not hold."""
        if self.refused:
            return []
        out = [name for name in ("tips", "contacts", "stayed") if getattr(self, name)]
        floors = FLOORS[self.case.known, self.mode]
        out += [f"{name} {getattr(self, name):.4f}" for name, most in floors.items() if not getattr(self, name) <= most]
        if self.case.gravity == "earth" and not self.clearance >= LEAST_CLEARANCE - 1e-9:
            out.append(f"clearance {self.clearance:.4f}")
        return out


def case_of(number: int) -> Case:
    """The settings go round: neighbouring numbers differ in ground, then gravity, payload, parameters."""
    return Case(
        number=number,
        ground=GROUNDS[number % 3],
        gravity=("earth", "moon")[number // 3 % 2],
        payload=bool(number // 6 % 2),
        known=bool(1 - number // 12 % 2),
    )


def spread(count: int) -> list[int]:
    """Numbers of cases that take all settings as evenly as so many can."""
    return list(range(count)) if count >= 24 else [round(i * 24 / count) + i % 3 for i in range(count)]


@cache
def rover_with(payload: bool) -> Robot:
    athlete = footfall.load_robot("athlete")
    return Robot(with_payload(athlete.description, PAYLOAD)) if payload else athlete


def ground_of(case: Case) -> Dem:
    seed = SEED + case.number
    if case.ground == "flat":
        return plane(size=8.0, resolution=0.05)
    if case.ground == "fractal":
        return fractal(size=8.0, resolution=0.05, roughness=0.03, seed=seed)
    return rock_field(size=8.0, resolution=0.025, abundance=0.06, largest=0.5, seed=seed)


def physics_of(case: Case, rng: np.random.Generator) -> PhysicsSettings:
    gravity = GRAVITIES[case.gravity]
    if case.known:
        return PhysicsSettings(gravity=gravity)
    # all of a kind alike, at either end, or each one another
    alike, way, heavier = rng.random() < 0.5, rng.choice([-1.0, 1.0], 2), rng.choice([-1.0, 1.0])
    return PhysicsSettings(
        gravity=gravity,
        stiffness_scale=float(1 + 0.2 * way[0]) if alike else 1.0,
        wheel_scale=float(1 + 0.3 * way[1]) if alike else 1.0,
        stiffness_spread=0.0 if alike else 0.2,
        wheel_spread=0.0 if alike else 0.3,
        mass_scale=float(1 + 0.05 * heavier),
        wheel_shape="crowned",
        noise=NOISE,
        seed=case.number,
    )


@dataclass(frozen=True)
class Start:
    """A rover at rest with a step that is planned from its telemetry. physics: with which it can be had again."""

    robot: Robot
    dem: Dem
    stood: RobotState
    physics: PhysicsSettings
    state: RobotState
    commanded: np.ndarray
    plan: StepPlan

    def rover(self) -> PhysicalRover:
        return at_rest(self.robot, self.dem, self.stood, self.physics)


def at_rest(robot: Robot, dem: Dem, state: RobotState, physics: PhysicsSettings) -> PhysicalRover:
    rover = PhysicalRover(robot, dem, state, physics)
    rover.step(CALM)
    return rover


def start_of(case: Case) -> Start | None:
    """The first drawn place and footfall that a step is found for; None where there is none in TRIES."""
    rng = np.random.default_rng([SEED, case.number])
    robot, dem, physics = rover_with(case.payload), ground_of(case), physics_of(case, rng)
    for _ in range(TRIES):
        x, y = rng.uniform(-0.6, 0.6, 2)
        try:
            stood = footfall.stand(robot, dem, float(x), float(y), float(rng.uniform(-np.pi, np.pi)))
            rover = at_rest(robot, dem, stood, physics)
        except InvalidInput:
            continue
        frame = rover.frame()
        state, commanded = frame.state, np.array(frame.commanded)
        wheels = apply(state.T_site_base, wheel_centers(robot, state.posture))
        for _ in range(TRIES):
            leg, away, angle = int(rng.integers(robot.leg_count)), rng.uniform(0.1, 0.5), rng.uniform(-np.pi, np.pi)
            target = wheels[leg, :2] + away * np.array([np.cos(angle), np.sin(angle)])
            found = footfall.plan_step(robot, dem, state, leg, (float(target[0]), float(target[1])))
            if found.plan is not None:
                return Start(robot, dem, stood, physics, state, commanded, found.plan)
    return None


def settings_of(case: Case, mode: str) -> ExecutionSettings:
    balance = BalanceSettings(gravity=GRAVITIES[case.gravity])
    return ExecutionSettings(mode=mode, compliance=ComplianceSettings(balance=balance))


def outcomes(number: int) -> list[Outcome]:
    """One case in every mode."""
    case = case_of(number)
    start = start_of(case)
    if start is None:
        return [Outcome(case, mode, refused=f"no step is found in {TRIES} places") for mode in MODES]
    return [outcome(case, start, mode) for mode in MODES]


def outcome(case: Case, start: Start, mode: str) -> Outcome:
    found = plan_execution(
        start.robot, start.dem, start.state, start.plan, settings_of(case, mode), commanded=start.commanded
    )
    if found.status is not Status.FOUND or found.execution is None:
        return Outcome(case, mode, refused=found.reason)
    done = found.execution
    commands, rover = sequence_of_execution(done, start.robot), start.rover()
    first = rover.T_site_base
    report = referee(
        start.robot,
        commands,
        start.dem,
        RefereeSettings(start.physics),
        goals={done.leg: done.plan.contact},
        poses=commands.Ts_site_base,
        rover=rover,
    )
    return judged(case, start.robot, done, commands, report, first)


def judged(
    case: Case, robot: Robot, done: Execution, commands: Commands, report: RefereeReport, first: np.ndarray
) -> Outcome:
    """first: (4, 4) true pose of the chassis at rest before the first row."""
    landed = [event for event in report.events if event.leg == done.leg and event.kind == "touch-down"]
    lifted = [event for event in report.events if event.leg == done.leg and event.kind == "lift-off"]
    lost = [event for event in report.events if event.kind == "lift-off" and not event.planned]
    swings = [i for i, phase in enumerate(done.phases) if phase == "swing"]
    turns = [np.linalg.norm(T[:3, :3] - first[:3, :3], 2) for T in report.Ts_site_base]
    goal = apply(done.plan.T_site_base, wheel_centers(robot, done.plan.waypoints[-1])[done.leg])
    sags = sags_of(robot, done, commands, report)
    return Outcome(
        case=case,
        mode=done.mode,
        tips=int(bool(report.tipped)),
        contacts=len(report.contacts) + len(lost),
        stayed=abs(len(landed) - 1) + abs(len(lifted) - 1),
        touch=float(np.linalg.norm((landed[-1].center - goal)[:2])) if landed else np.nan,
        contact=landed[-1].off if landed else np.nan,
        met=float(np.linalg.norm((landed[-1].point - done.touch_down)[:2])) if landed else np.nan,
        stands=float(report.touch[done.leg]),
        slip=float(report.slip.max()),
        chassis=float(np.linalg.norm(report.Ts_site_base[:, :3, 3] - first[:3, 3], axis=1).max()),
        turn=float(max(turns)),
        sag_chassis=float(sags[:, 0].max()),
        sag_wheel=float(sags[:, 1].max()),
        sag=float(sags[:, 2].max()),
        clearance=float(done.clearance[swings].min()),
        seen=report.clearance,
        seconds=float(report.ended[-1]),
        said=report.failures,
    )


def sags_of(robot: Robot, done: Execution, commands: Commands, report: RefereeReport) -> np.ndarray:
    """(k, 3) at the end of each pause whose set points don't depend on where the lowering stopped: how far chassis and
    swinging hub are from where they were predicted [m], and the larger of both over what is allowed of it."""
    if commands.commanded is None or commands.Ts_site_base is None:
        raise RuntimeError("commands of an execution come with set points and poses")
    own = slice(6 * done.leg, 6 * done.leg + 6)
    begin = done.Ts_site_base[0]
    rows = []
    for row, command in enumerate(commands.commands[: report.commands]):
        if command.name != "WAIT" or command.phase == "lower":
            continue
        T, q = commands.Ts_site_base[row], commands.predicted[row]
        hubs = [
            apply(T_site_base, leg_wheel_pose(robot, posture[own], done.leg)[:3, 3])
            for T_site_base, posture in (
                (T, q),
                (report.Ts_site_base[row], report.postures[row]),
                (begin, commands.commanded[row]),
            )
        ]
        errors = (
            float(np.linalg.norm(report.Ts_site_base[row, :3, 3] - T[:3, 3])),
            float(np.linalg.norm(hubs[1] - hubs[0])),
        )
        predicted = (float(np.linalg.norm(T[:3, 3] - begin[:3, 3])), float(np.linalg.norm(hubs[0] - hubs[2])))
        over = max(e / max(SAG_FLOOR, SAG_SHARE * sag) for e, sag in zip(errors, predicted, strict=True))
        rows.append((*errors, over))
    return np.array(rows)


def run(numbers: Sequence[int], workers: int, state: Path | None = None) -> Iterator[Outcome]:
    """All outcomes, case by case; those that ``state`` keeps are not run again.

    Raises InvalidInput where the state is of another seed or of other code than this.
    """
    if state is None:
        yield from chain.from_iterable(_each(numbers, workers))
        return
    kept = KeptRun(state, {"seed": SEED, "code": digest_of(JUDGED, ("referee.py",))})
    done = {part["number"]: [_outcome(row) for row in part["outcomes"]] for part in kept.parts}
    yield from chain.from_iterable(done[number] for number in numbers if number in done)
    todo = [number for number in numbers if number not in done]
    for number, found in zip(todo, _each(todo, workers), strict=True):
        kept.add({"number": number, "outcomes": [asdict(one) for one in found]})
        yield from found


def _each(numbers: Sequence[int], workers: int) -> Iterator[list[Outcome]]:
    if workers == 1:
        yield from map(outcomes, numbers)
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield from pool.imap(outcomes, numbers)


def _outcome(row: dict[str, Any]) -> Outcome:
    return Outcome(**(row | {"case": Case(**row["case"]), "said": tuple(row["said"])}))


QUANTITIES = {
    "touch": "m",
    "contact": "m",
    "met": "m",
    "stands": "m",
    "slip": "m",
    "chassis": "m",
    "turn": "rad",
    "sag_chassis": "m",
    "sag_wheel": "m",
    "sag": "of allowed",
}
COUNTS = ("tips", "contacts", "stayed")


def figures_of(found: Sequence[Outcome]) -> Iterator[Figure]:
    """By mode and parameters: counts, worst with its floor, and all samples of every quantity."""
    for known in (True, False):
        for mode in MODES:
            asked = [one for one in found if one.case.known == known and one.mode == mode]
            ran = [one for one in asked if not one.refused]
            name = f"referee.{'known' if known else 'unknown'}.{mode}"
            if not asked:
                continue
            yield Figure(f"{name}.accepted", (len(ran) / len(asked),), "share")
            if not ran:
                continue
            yield Figure(f"{name}.missed", tuple(float(bool(one.missed())) for one in ran), "share")
            for count in COUNTS:
                yield Figure(f"{name}.{count}", (float(sum(getattr(one, count) for one in ran)),), "steps", 0.0)
            for quantity, unit in QUANTITIES.items():
                samples = tuple(float(getattr(one, quantity)) for one in ran)
                yield Figure(f"{name}.{quantity}.worst", (max(samples),), unit, FLOORS[known, mode].get(quantity))
                yield Figure(f"{name}.{quantity}", samples, unit)
            on_earth = [one.clearance for one in ran if one.case.gravity == "earth"]
            if on_earth:
                yield Figure(f"{name}.least_clearance", (min(on_earth),), "m", LEAST_CLEARANCE, at_most=False)


def figures(quick: bool) -> Iterator[Figure]:
    numbers = spread(QUICK_STEPS if quick else STEPS)
    yield from figures_of(list(run(numbers, workers=min(2, os.cpu_count() or 1))))


def main() -> None:
    """Run steps, name those that missed a floor as they come, then print every figure."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--steps", type=int, default=24)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of steps")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--state", type=Path, help="file that a run is kept in, and gone on with")
    asked = parser.parse_args()
    found = []
    for one in run(asked.only or spread(asked.steps), asked.workers, asked.state):
        found.append(one)
        told = f"refused: {one.refused}" if one.refused else "; ".join(one.missed()) or "holds"
        print(f"{one.case!s:<44}{one.mode:<14}{told}", *one.said, sep="\n    ", flush=True)
    for figure in figures_of(found):
        row = figure.as_dict()
        print(
            f"{figure.name:<52}{row['median']:>12.4g}{row['p95']:>12.4g}  "
            f"{figure.unit:<11}{row['n']:>4}  {promised(row)}"
        )


if __name__ == "__main__":
    sys.exit(main())
