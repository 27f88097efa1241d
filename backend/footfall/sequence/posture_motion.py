"""The rules of motion for a POSTURE_MOVE: all legs move, and the chassis goes where the standing wheels let it.

How the feet and the last joints of standing legs meet the ground is no matter of such a move: they stay where they
are. So they are asked only not to be pressed into it; all other parts keep their clearances.
"""

from collections.abc import Iterator

import numpy as np

from footfall.balance.payload import loaded
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.maps.standing import STANDING_GAP, contacts, wheel_gaps
from footfall.planning.body.move_checks import LOCKED, coms_of
from footfall.planning.scene.whole_body import NearestGap, WholeBody
from footfall.robot.description import link_name
from footfall.robot.kinematics import wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.commands import RuleResult
from footfall.sequence.passage import CLEAR, Passage, carried
from footfall.sequence.sampled import balance_result, drag_result, samples, torque_result
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.terrain.dem import Dem


def check_posture_move(
    robot: Robot,
    row: int,
    passage: Passage,
    body: WholeBody,
    dem: Dem,
    touched: dict[int, Array],
    settings: SequenceSettings,
) -> Iterator[RuleResult]:
    """Results of the rules of motion for one row that moves all legs.

    Args:
        robot: the rover.
        row: its number.
        passage: how it goes.
        body: chassis and links over the ground.
        dem: the ground, in site.
        touched: leg → where its wheel came down, (3,) in site [m]; kept from row to row.
        settings: how closely is looked, and what is asked for.

    Yields:
        The results.
    """
    legs = list(passage.standing)
    postures = samples(passage.before, passage.after, settings.sample)
    followed = [carried(robot, passage.T_before, passage.before, posture, legs) for posture in postures]
    Ts_site_base = np.array([T for T, _ in followed])
    holding = [leg for leg in legs if all(leg in held for _, held in followed)]
    gaps = np.array([wheel_gaps(robot, dem, q, T, robot.legs) for q, T in zip(postures, Ts_site_base, strict=True)])
    Ts_base_link = body.poses(postures)
    yield _near("self-collision", row, body.own_gap(Ts_base_link), len(postures))
    yield _ground(robot, row, body, Ts_site_base[:, None] @ Ts_base_link, legs, gaps)
    yield _drag(robot, row, postures, Ts_site_base, gaps, touched)
    support = contacts(robot, dem, passage.before, passage.T_before, holding)
    _, coms = loaded(robot, coms_of(robot, postures[0], postures), settings.balance)
    in_site = np.einsum("nij,nj->ni", Ts_site_base[:, :3, :3], coms) + Ts_site_base[:, :3, 3]
    yield balance_result(row, support, in_site, settings)
    yield torque_result(robot, row, postures, Ts_site_base, holding, support, settings)


def _near(rule: str, row: int, found: NearestGap, count: int) -> RuleResult:
    spare = found.gap.spare
    if spare >= 0:
        return RuleResult(rule, row, True, spare, "m", f"clear at {count} samples")
    at = f"{found.at / (count - 1):.0%} of the row"
    text = f"{found.gap.between} are {-spare:z.3f} m nearer than they may be, nearest at {at}"
    return RuleResult(rule, row, False, spare, "m", text)


def _ground(robot: Robot, row: int, body: WholeBody, Ts_site_link: Array, legs: list[int], gaps: Array) -> RuleResult:
    """What is asked of the parts that move, and of wheels that they are not pressed into the ground."""
    locked = {link_name(leg, part) for leg in legs for part in LOCKED}
    # a wheel in the air may come down
    landing = [leg for leg in robot.legs if leg not in legs]
    links = [link for link in body.links if link not in locked]
    nearest = body.ground_gap(Ts_site_link, links, touching=landing)
    found = _near("terrain-collision", row, nearest, len(gaps))
    deepest = robot.description.clearances.wheel_sink + STANDING_GAP
    sunk = np.nan_to_num(-gaps, nan=-np.inf)
    if not found.holds or sunk.max(initial=-np.inf) <= deepest:
        return found
    at, column = np.unravel_index(int(np.argmax(sunk)), sunk.shape)
    deep, allowed = beside(float(sunk[at, column]), deepest)
    text = (
        f"the wheel of leg {robot.legs[int(column)]} is {deep} m in the ground, "
        f"{allowed} m are allowed, deepest at {at / (len(gaps) - 1):.0%} of the row"
    )
    return RuleResult("terrain-collision", row, False, deepest - float(sunk[at, column]), "m", text)


def _drag(
    robot: Robot,
    row: int,
    postures: Array,
    Ts_site_base: Array,
    gaps: Array,
    touched: dict[int, Array],
) -> RuleResult:
    """Wheels that are down stay where they are, however the legs above them turn."""
    worst, which, at = 0.0, 0, 0
    for index, (posture, T_site_base) in enumerate(zip(postures, Ts_site_base, strict=True)):
        centers = apply(T_site_base, wheel_centers(robot, posture))[:, :2]
        for leg, gap in zip(robot.legs, gaps[index], strict=True):
            if gap > CLEAR:
                touched.pop(leg, None)
                continue
            away = float(np.hypot(*(centers[leg] - touched.setdefault(leg, centers[leg]))))
            if away > worst:
                worst, which, at = away, leg, index
    return drag_result(row, f"the wheel of leg {which}", worst, at / (len(postures) - 1))
