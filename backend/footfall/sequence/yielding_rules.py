"""The rules of motion for a rover that sags, asked where it is predicted to be.

=================  ==============================================================  =========
rule               what it asks                                                    margin
=================  ==============================================================  =========
predicted-limits   the joints, where they give way to, are within their limits     rad
self-collision     dense samples keep the clearances between links                 m
terrain-collision  dense samples keep the clearances to the true terrain; wheels   m
                   that touch are pressed in, one that swings may not touch
no-drag            the material of a wheel that bears slips over the ground by     m
                   little: 5 mm of one that stands, 20 mm of one that steps
balance            the wheels that stand keep their load, and the centre of mass   m
                   is inside their polygon
torque             stiffness × (set point − joint) within the joint's limit; what  ratio
                   is beyond it already gets no worse, and is within it in the end
lift-off           at the end of a lift the wheel is off the ground                m
ends-on-ground     a leg that was moved by itself, or stood, bears load at the end N
=================  ==============================================================  =========

Which leg steps says the command, or for a whole posture the command of one leg in the same step. Between two equilibria
of the prediction, at most 0.05 rad of the set points apart, joints and chassis are taken to go straight.
"""

from collections.abc import Iterator

import numpy as np

from footfall.balance.payload import loaded
from footfall.balance.support import margins
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.planning.answers import No
from footfall.planning.body.move_checks import LOCKED, coms_of, dense
from footfall.planning.compliance.compliant_rover import CompliantRover, RestingRover
from footfall.planning.compliance.from_telemetry import LEAST_LOAD
from footfall.planning.execution.plan import rim_clearance
from footfall.planning.execution.prediction_checks import WORSE
from footfall.planning.execution.problem import PHASES
from footfall.planning.scene.whole_body import NearestGap, WholeBody
from footfall.robot.description import link_name
from footfall.robot.limits import room_to_limits
from footfall.robot.model import Robot
from footfall.robot.tolerance import inside, within_in_words
from footfall.sequence.commands import Command, RuleResult
from footfall.sequence.predict import target
from footfall.sequence.sampled import DRAG
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import Yielding, YieldingRow
from footfall.telemetry.command_kinds import WAIT

SLIP = 0.005
"""How far the material of a standing wheel may be predicted to slip over the ground [m]; of one that steps DRAG."""
WANTED = 0.05
"""Height over the ground that a lifted wheel should have [m]; what it lacks is told."""


def check_yielding(
    robot: Robot, commands: tuple[Command, ...], way: Yielding, settings: SequenceSettings
) -> list[RuleResult]:
    """Results of the rules of motion for every row that moves joints and is predicted, and of how the last one ends.

    A row that is not predicted to its end breaks the rule balance, and nothing is asked of what comes after it.
    """
    moves = [row for row in range(len(way.rows)) if target(commands[row], robot.leg_count) is not None]
    if not moves:
        return []
    if isinstance(way.ground, No):
        return [RuleResult("terrain-collision", moves[0], False, np.nan, "m", way.ground.reason)]
    body = WholeBody(robot, way.ground, settings.clearance)
    stepping = stepping_legs(commands)
    lifts = {max(up) for rows in _steps(commands) if (up := [i for i in rows if commands[i].phase == "lift"])}
    slipped = np.zeros((robot.leg_count, 3))
    allowed = _shares_at_first(robot, way.rows[moves[0]].rests[0])
    results: list[RuleResult] = []
    for row in moves:
        going, leg = way.rows[row], stepping[row]
        if going.reason:
            return [*results, RuleResult("balance", row, False, np.nan, "", going.reason)]
        results.append(_limits(robot, row, going))
        results += _collisions(row, going, body, leg, commands[row].phase == "swing")
        results.append(_drag(way.rover, row, going, leg, slipped))
        results.append(_balance(way.rover, row, going, leg, settings))
        results.append(_torque(robot, row, going, allowed, row == moves[-1]))
        allowed = np.where(_shares(robot, going.rests[-1]) > 1.0, allowed, 1.0)
        if row in lifts and leg is not None:
            results.append(_lift_off(way.rover, row, going.rests[-1], leg))
    return results + list(_ends(way, {leg: row for row in moves if (leg := stepping[row]) is not None}, moves[-1]))


def stepping_legs(commands: tuple[Command, ...]) -> list[int | None]:
    """The leg that each row steps with: the one it names; of a whole posture in a step, the one named in that step."""
    legs = [command.leg for command in commands]
    for rows in _steps(commands):
        named = {legs[row] for row in rows} - {None}
        if len(named) == 1:
            leg = named.pop()
            for row in rows:
                legs[row] = leg
    return legs


def _steps(commands: tuple[Command, ...]) -> list[list[int]]:
    """Rows with phases of a step, in each step never back to an earlier phase; a WAIT between them ends none."""
    steps: list[list[int]] = []
    reached = len(PHASES)
    for row, command in enumerate(commands):
        if command.kind is WAIT:
            continue
        phase = PHASES.index(command.phase) if command.phase in PHASES else None
        if phase is None:
            reached = len(PHASES)
            continue
        if phase < reached:
            steps.append([])
        steps[-1].append(row)
        reached = phase
    return steps


def _limits(robot: Robot, row: int, going: YieldingRow) -> RuleResult:
    # how the rover gave way was measured, and what follows from it is no surer
    postures = inside(robot, np.array([rest.posture for rest in going.rests]))
    spare = room_to_limits(robot, postures)
    at, joint = np.unravel_index(int(np.argmin(spare)), spare.shape)
    least = float(spare[at, joint])
    text = (
        f"{robot.joint_names[joint]} is predicted at {within_in_words(robot, int(joint), float(postures[at, joint]))}"
    )
    return RuleResult("predicted-limits", row, least >= 0, least, "rad", text)


def _collisions(row: int, going: YieldingRow, body: WholeBody, leg: int | None, swings: bool) -> Iterator[RuleResult]:
    """Of the whole rover; wheels that touch, and the last joints above them, are pressed in wherever they are."""
    path = dense(np.array([rest.posture for rest in going.rests]), np.array([rest.T_site_base for rest in going.rests]))
    Ts_base_link = body.poses(path.postures)
    yield _near("self-collision", row, body.own_gap(Ts_base_link), path.part)
    touching = np.any([rest.touching for rest in going.rests], axis=0)
    swinging = leg if swings else None
    pressed = {link_name(i, part) for i in body.robot.legs if touching[i] and i != swinging for part in LOCKED}
    landing = [i for i in body.robot.legs if not touching[i] and i != swinging]
    links = [link for link in body.links if link not in pressed]
    found = body.ground_gap(path.Ts_site_base[:, None] @ Ts_base_link, links, touching=landing)
    yield _near("terrain-collision", row, found, path.part)


def _near(rule: str, row: int, found: NearestGap, part: Array) -> RuleResult:
    spare = found.gap.spare
    if spare >= 0:
        return RuleResult(rule, row, True, spare, "m", f"clear at {len(part)} samples")
    text = (
        f"{found.gap.between} are {-spare:z.3f} m nearer than they may be, nearest at {part[found.at]:.0%} of the row"
    )
    return RuleResult(rule, row, False, spare, "m", text)


def _drag(rover: CompliantRover, row: int, going: YieldingRow, leg: int | None, slipped: Array) -> RuleResult:
    """slipped: (legs, 3) how far each wheel has slipped since it came down [m]; kept from row to row."""
    allowed = np.full(rover.robot.leg_count, SLIP)
    if leg is not None:
        allowed[leg] = DRAG
    worst, which, at = np.inf, 0, 0
    for number, (before, now) in enumerate(zip(going.rests[:-1], going.rests[1:], strict=True), start=1):
        slipped += np.where((now.loads >= _least_load(rover))[:, None], slip(rover, before, now), 0.0)
        slipped[~now.touching] = 0.0
        spare = allowed - np.linalg.norm(slipped, axis=1)
        if spare.min() < worst:
            worst, which, at = float(spare.min()), int(np.argmin(spare)), number
    slips, most = beside(allowed[which] - worst, allowed[which], 4)
    text = f"the wheel of leg {which} slips {slips} m while it is down, {most} m are"
    where = f" allowed, farthest at {at / (len(going.rests) - 1):.0%} of the row" if worst < 0 else " allowed"
    return RuleResult("no-drag", row, worst >= 0, worst, "m", text + where)


def _least_load(rover: CompliantRover) -> float:
    """A wheel that bears less is as good as in the air [N]."""
    return LEAST_LOAD * rover.mass * float(np.linalg.norm(rover.gravity))


def slip(rover: CompliantRover, before: RestingRover, now: RestingRover) -> Array:
    """How far the material of each wheel that touches in both moved over the ground, site, (legs, 3) [m].

    A rim moves with its locked wheel, by the turn × the normal × the radius that it rolls on, and what is beyond slips.
    """
    turns = now.turns @ np.swapaxes(before.turns, 1, 2)
    # small turns: their rotation vectors are in the skew part
    rotvecs = 0.5 * np.stack(
        [turns[:, 2, 1] - turns[:, 1, 2], turns[:, 0, 2] - turns[:, 2, 0], turns[:, 1, 0] - turns[:, 0, 1]], axis=1
    )
    moved = now.rims - before.rims - rover.body.rolled * np.cross(rotvecs, now.normals)
    moved -= np.sum(moved * now.normals, axis=1, keepdims=True) * now.normals
    return np.where((before.touching & now.touching)[:, None], moved, 0.0)


def _balance(
    rover: CompliantRover, row: int, going: YieldingRow, leg: int | None, settings: SequenceSettings
) -> RuleResult:
    """Over the wheels that stand when the row starts, without the one that steps; looked at along gravity."""
    robot, balance = rover.robot, rover.settings.balance
    legs = [i for i in robot.legs if going.rests[0].touching[i] and i != leg]
    share = 1.0 / max(len(going.rests) - 1, 1)
    loads = np.array([rest.loads[legs] for rest in going.rests])
    at, column = np.unravel_index(int(np.argmin(loads)), loads.shape)
    if loads[at, column] <= 0:
        text = f"the wheel of leg {legs[int(column)]} is predicted to bear nothing at {at * share:.0%} of the row"
        return RuleResult("balance", row, False, np.nan, "m", text)
    coms = coms_of(robot, going.rests[0].posture, np.array([rest.posture for rest in going.rests]))
    spare = np.empty(len(coms))
    for i, (rest, com) in enumerate(zip(going.rests, coms, strict=True)):
        center = balance.R_level_site @ apply(rest.T_site_base, loaded(robot, com, balance)[1])
        feet = rest.contacts[legs] @ balance.R_level_site.T
        spare[i] = margins(feet, center[None, :2], settings.conservative)[0]
    worst = int(np.argmin(spare))
    kind = "conservative support polygon" if settings.conservative else "support polygon"
    least = float(spare[worst]) - settings.least_margin
    kept, wanted = beside(float(spare[worst]), settings.least_margin)
    text = (
        f"margin {kept} m to the {kind} of {len(legs)} wheels, at least {wanted} m "
        f"wanted, least at {worst * share:.0%} of the row; leg {legs[int(column)]} bears least, "
        f"{loads[at, column]:z.0f} N"
    )
    return RuleResult("balance", row, least >= 0, least, "m", text)


def _shares(robot: Robot, rest: RestingRover) -> Array:
    """Of their torque limits that joints bear, (legs × 6,)."""
    return np.abs(rest.torques) / robot.torque_limits


def _shares_at_first(robot: Robot, rest: RestingRover) -> Array:
    """Of their limits that joints may bear until they are back within them, (legs × 6,).

    1, or hardly more than as the rover stands now: what bears too much already is led out of it.
    """
    return 1.0 + WORSE * np.maximum(_shares(robot, rest) - 1.0, 0.0)


def _torque(robot: Robot, row: int, going: YieldingRow, allowed: Array, ends: bool) -> RuleResult:
    """allowed: (legs × 6,) shares of the limits that joints may bear in the row; where it ends the motion, 1 then."""
    ratios = np.array([_shares(robot, rest) for rest in going.rests])
    most = np.tile(allowed, (len(ratios), 1))
    if ends:
        most[-1] = 1.0
    at, joint = np.unravel_index(int(np.argmax(ratios - (most - 1.0))), ratios.shape)
    ratio, limit = float(ratios[at, joint]), float(most[at, joint])
    used, where = beside(100 * ratio, 100 * limit, 0)[0], f"{at / (len(going.rests) - 1):.0%} of the row"
    text = f"{robot.joint_names[joint]} at {used}% of its limit at {where}"
    if limit > 1.0:
        text += f"; it bears too much already, and may bear {100 * limit:z.0f}% until it is back within its limit"
    return RuleResult("torque", row, ratio <= limit, limit - ratio, "of the limit", text)


def _lift_off(rover: CompliantRover, row: int, rest: RestingRover, leg: int) -> RuleResult:
    height = float(rim_clearance(rover.dem, rest.hubs[leg][None], rover.robot.wheel_radius)[0])
    lacking = WANTED - height
    if rest.touching[leg]:
        text = (
            f"the wheel of leg {leg} will not leave the ground: it is predicted {height:z.3f} m over it and still "
            f"bears {rest.loads[leg]:z.0f} N, {lacking:z.3f} m below the {WANTED:z.2f} m that it should be lifted"
        )
        return RuleResult("lift-off", row, False, min(height, 0.0), "m", text)
    text = f"the wheel of leg {leg} is predicted {height:z.3f} m over the ground"
    if lacking > 0:
        text += f", {lacking:z.3f} m below the {WANTED:z.2f} m that it should be lifted"
    return RuleResult("lift-off", row, True, height, "m", text)


def _ends(way: Yielding, last: dict[int, int], end: int) -> Iterator[RuleResult]:
    """last: leg → the last row that steps with it; end: the last row that moves anything."""
    rover, first, rest = way.rover, way.rows[0].rests[0], way.rows[-1].rests[-1]
    least = _least_load(rover)
    for leg in rover.robot.legs:
        load = float(rest.loads[leg])
        if leg not in last and (load >= least or not first.touching[leg]):
            continue
        bears, wanted = beside(load, least, 0)
        text = f"leg {leg} ends bearing {bears} N, at least {wanted} N wanted"
        yield RuleResult("ends-on-ground", last.get(leg, end), load >= least, load - least, "N", text)
