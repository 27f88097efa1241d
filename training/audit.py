"""What physics makes of the motions that a table chooses: ``python -m training.audit gaits.npz --routes 16``.

The table learns from quasi-static motions, which know no sag. Here routes are chosen and planned as in the comparison,
over ground that nobody learned from. A rover in MuJoCo carries out each iteration, from rest where it was planned from.
A controller that holds the planned posture is assumed: set points follow what the joints miss (integral action).
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from footfall.balance.balance_settings import GRAVITIES
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.io.policies import read_policy
from footfall.planning.choice.iteration import Plan
from footfall.planning.choice.policy import GaitPolicy
from footfall.planning.execution.pace import durations
from footfall.sim.physics.physics_settings import TIME_STEP, PhysicsSettings
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.run_observer import RunObserver
from footfall.telemetry.command_kinds import POSTURE_MOVE
from footfall.telemetry.link import CommandMessage
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from training.choosers import LEARNED, NAMES, chooser
from training.command import add_who_makes, as_many_as, exit_code, length
from training.finished import Finished, Item, completed
from training.gait_policy import what_rollouts_are_of
from training.grounds import UNSEEN, ground
from training.intervals import in_words, share
from training.route import robot, walked

GAIN = 0.7
"""Share of what a joint misses that its set point is moved by, at each waypoint."""
RESTS = 1.0
"""Seconds that the rover is let come to rest after the last one."""


@dataclass(frozen=True)
class Carried:
    """What physics made of one iteration.

    action: by which it went; metres: that the chassis was planned to go. fell: why the rover tipped, or did not stand
    where the plan begins; or empty. contacts: that were not of a wheel with the ground. off: how far from where it was
    planned to the chassis ended, seen from above [m]; NaN where it fell. torque: largest share of its limit that a
    joint's servo gave.
    """

    action: str
    metres: float
    fell: str = ""
    contacts: tuple[str, ...] = ()
    off: float = np.nan
    torque: float = np.nan


def carried_out(
    dem: Dem, state: RobotState, plan: Plan, action: str, speed: float, physics: PhysicsSettings
) -> Carried:
    """A plan, carried out from rest in the state that it goes from.

    speed: share of the joints' limits of speed.
    """
    T_begin, T_end = plan.Ts_site_base[0], plan.Ts_site_base[-1]
    metres = float(np.hypot(*(T_end - T_begin)[:2, 3]))
    try:
        rover = PhysicalRover(robot(), dem, state, physics)
    except InvalidInput as err:
        return Carried(action, metres, fell=err.message)
    watch = RunObserver(rover, {})
    missed = rover.commanded - state.posture
    seconds = durations(robot(), plan.waypoints, plan.phases, speed)
    for row, (posture, lasts) in enumerate(zip(plan.waypoints[1:], seconds[1:], strict=True)):
        _turn(rover, watch, row, posture + missed, float(lasts))
        missed = missed + GAIN * (posture - rover.posture)
    _turn(rover, watch, len(seconds), plan.waypoints[-1] + missed, RESTS)
    return Carried(
        action,
        metres,
        fell=rover.fault,
        contacts=tuple(f"{one.link_a}, {one.link_b}" for one in watch.contacts),
        off=np.nan if rover.fault else float(np.hypot(*(rover.T_site_base - T_end)[:2, 3])),
        torque=float(watch.torque.max()),
    )


def _turn(rover: PhysicalRover, watch: RunObserver, row: int, set_points: Array, seconds: float) -> None:
    watch.row(row, None, swings=False)
    lasts = max(seconds, TIME_STEP)
    rover.command(CommandMessage(f"{row}", "audit", row, POSTURE_MOVE.name, None, set_points, lasts))
    while rover.mode == "moving":
        rover.step(TIME_STEP)
        watch.look()


def audited(task: tuple[str, tuple[str, int, float, GaitPolicy, PhysicsSettings]]) -> tuple[str, Item]:
    """The iterations of one route by one chooser."""
    key, (name, seed, metres, policy, physics) = task
    went: list[tuple[RobotState, Plan]] = []
    route = walked(seed, metres, chooser(name, policy), policy.settings, went=lambda *one: went.append(one))
    actions = [one.action for one in route.decisions if not one.came.refused]
    dem, speed = ground(seed, metres), policy.settings.speed
    found = [
        carried_out(dem, state, plan, action, speed, physics)
        for (state, plan), action in zip(went, actions, strict=True)
    ]
    return key, {"ended": route.ended, "iterations": [asdict(one) for one in found]}


def in_sum(what: str, found: Sequence[Carried]) -> str:
    """In a line: shares with 95 % intervals, and the largest of what was measured."""
    n, metres = len(found), sum(one.metres for one in found)
    fell, touched = sum(bool(one.fell) for one in found), sum(bool(one.contacts) for one in found)
    over = sum(one.torque > 1.0 for one in found)
    stood = [one for one in found if not one.fell]
    ends = np.array([1000.0 * one.off for one in stood] or [np.nan])
    torque = max((one.torque for one in stood), default=np.nan)
    return (
        f"{what}: {n} iterations, {metres:.1f} m; fell {fell}, {in_words(share(fell, n))}; touched what they should "
        f"not {touched}, {in_words(share(touched, n))}; over a limit of torque {over}, {in_words(share(over, n))}; "
        f"torque at most {torque:.2f} of it; ended {np.median(ends):.0f} mm off, 95 of 100 within "
        f"{np.percentile(ends, 95):.0f} mm"
    )


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path, help="file that training.gait_policy wrote")
    parser.add_argument("--routes", type=as_many_as(UNSEEN), default=16)
    parser.add_argument("--metres", type=length, default=6.0, help="of each")
    parser.add_argument("--chosen-by", choices=NAMES, default=LEARNED)
    parser.add_argument("--gravity", choices=tuple(GRAVITIES), default="earth", help="of the world in physics")
    add_who_makes(parser)
    parser.add_argument("--finished", type=Path, help="file of finished routes; default: beside the policy")
    asked = parser.parse_args()
    policy = read_policy(asked.policy, robot().digest)
    physics = PhysicsSettings(gravity=GRAVITIES[asked.gravity])
    of = {**what_rollouts_are_of(asked.metres, policy.settings), "policy": policy.digest, "physics": physics.digest}
    finished = Finished(asked.finished or asked.policy.with_suffix(".audited.jsonl"), of)
    name = asked.chosen_by
    tasks = [(f"{name} {seed}", (name, seed, asked.metres, policy, physics)) for seed in UNSEEN[: asked.routes]]
    items = completed(finished, tasks, audited, _tell, asked.processes, asked.scheduler)
    found: list[Carried] = []
    for (_, (_, seed, *_)), item in zip(tasks, items, strict=True):
        own = [Carried(**{**one, "contacts": tuple(one["contacts"])}) for one in item["iterations"]]
        found += own
        print(in_sum(f"{seed}, {item['ended']}", own) if own else f"{seed}, {item['ended']}: nothing was carried out")
        for number, one in enumerate(own, 1):
            if one.fell or one.contacts or one.torque > 1.0:
                told = "; ".join((one.fell, *one.contacts)).strip("; ") or f"torque {one.torque:.2f} of its limit"
                print(f"  iteration {number}, {one.action}: {told}")
    for action in sorted({one.action for one in found}):
        print(in_sum(action, [one for one in found if one.action == action]))
    if found:
        print(in_sum(f"{len(tasks)} routes, chosen by: {name}", found))
    return 0 if found else 1


if __name__ == "__main__":
    raise SystemExit(exit_code(main))
