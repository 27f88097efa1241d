"""Rows at dense samples, and what rules make of them: one wording for the moves of one leg and of all."""

import numpy as np

from footfall.balance.support import margins
from footfall.balance.torques import torque_check
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.maps.standing import Contacts
from footfall.robot.model import Robot
from footfall.sequence.commands import RuleResult
from footfall.sequence.sequence_settings import SequenceSettings

DRAG = 0.02
"""How far a wheel may move sideways while it is down on the ground [m]."""
TORQUE_SAMPLING = 0.05
"""Largest joint step between two postures whose torques are checked [rad]: each is a linear program."""


def samples(before: Array, reached: Array, largest_step: float) -> Array:
    """Postures on the straight line between two, ends included.

    Args:
        before: where it begins, (legs × 6,) [rad].
        reached: where it ends, (legs × 6,) [rad].
        largest_step: of a joint between two [rad].

    Returns:
        (n, legs × 6) [rad].
    """
    count = max(1, int(np.ceil(np.max(np.abs(reached - before)) / largest_step)))
    return before + np.linspace(0.0, 1.0, count + 1)[:, None] * (reached - before)


def drag_result(row: int, wheel: str, worst: float, at: float) -> RuleResult:
    """The rule no-drag.

    Args:
        row: its number.
        wheel: that was moved sideways, for a person.
        worst: how far [m].
        at: share of the row where that was.

    Returns:
        The result.
    """
    moved, allowed = beside(float(worst), DRAG)
    text = f"{wheel} moves {moved} m sideways while it is down, {allowed} m are allowed"
    where = f", farthest at {at:.0%} of the row" if worst > DRAG else ""
    return RuleResult("no-drag", row, worst <= DRAG, DRAG - worst, "m", text + where)


def balance_result(row: int, support: Contacts, coms: Array, settings: SequenceSettings) -> RuleResult:
    """The rule balance.

    Args:
        row: its number.
        support: the feet that stand.
        coms: centres of mass, (n, 3) in site [m].
        settings: which polygon counts, and the margin that is asked for.

    Returns:
        The result.
    """
    all_margins = margins(support.points, coms[:, :2], settings.conservative)
    worst = int(np.argmin(all_margins))
    kind = "conservative support polygon" if settings.conservative else "support polygon"
    spare = float(all_margins[worst]) - settings.least_margin
    kept, wanted = beside(float(all_margins[worst]), settings.least_margin)
    text = (
        f"margin {kept} m to the {kind} of {len(support.points)} feet, "
        f"at least {wanted} m wanted, least at {worst / (len(coms) - 1):.0%} of the row"
    )
    return RuleResult("balance", row, spare >= 0, spare, "m", text)


def torque_result(
    robot: Robot,
    row: int,
    postures: Array,
    Ts_site_base: Array,
    down: list[int],
    support: Contacts,
    settings: SequenceSettings,
) -> RuleResult:
    """The rule torque.

    Args:
        robot: the rover.
        row: its number.
        postures: (n, legs × 6) [rad].
        Ts_site_base: poses of the chassis, (n, 4, 4).
        down: numbers of the legs that stand.
        support: their contacts.
        settings: friction and payload.

    Returns:
        The result.
    """
    balance = settings.balance
    every = max(1, int(TORQUE_SAMPLING / settings.sample))
    chosen = sorted({*range(0, len(postures), every), len(postures) - 1})
    checks = [torque_check(robot, postures[i], Ts_site_base[i], down, support.normals, balance) for i in chosen]
    worst = int(np.argmax([check.ratio for check in checks]))
    at, check = f"at {chosen[worst] / (len(postures) - 1):.0%} of the row", checks[worst]
    text = f"{check.joint_name} at {beside(100 * check.ratio, 100.0, 0)[0]}% of its limit {at}"
    if not check.feasible:
        text = f"no contact forces inside friction hold the rover {at}"
    margin = 1.0 - check.ratio if check.feasible else np.nan
    return RuleResult("torque", row, check.holds, margin, "of the limit", text)
