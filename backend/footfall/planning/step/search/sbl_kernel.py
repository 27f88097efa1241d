"""SBL over surely free postures of a leg, compiled: two trees, checked lazily.

G. Sánchez & J.-C. Latombe, "A single-query bi-directional probabilistic roadmap planner with lazy collision checking",
ISRR 2001, and "On delaying collision checking in PRM planning", IJRR 2002; see sbl.py for the same search over any
test. Here a configuration counts as free only where it is sure (leg_free_kernel.py), and trees are joined over any
distance: of a bridge that is blocked mostly the middle is, so trying one costs little. Therefore the first milestones
are placed around the middle between start and goal, where one is often a way around by itself. Distances are in the
maximum norm.

What hangs from the deck or stands beside the hip splits the postures in two: the leg has to fold, turn past it with its
first joint, and unfold. Milestones near others hardly ever lead through such a passage, long in the first joint and
narrow in the rest. So after those around the middle some are placed in pairs: the leg's pitches are drawn from all they
may be, and where the leg surely turns from the start's first angle to the goal's so, both ends of that turn are
milestones.

All segments but the bridge just tried belong to one of the trees, so each is known by its milestone farther from the
root. When a bridge has joined the trees and a segment of the route turns out to be blocked, what hangs behind that
segment passes to the other tree over the bridge.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.compiled import njit
from footfall.core.arrays import Array
from footfall.planning.scene.leg_free_kernel import BodyTables, edge_is_sure, halvings, is_sure, level_is_sure
from footfall.robot.proof.leg_clearance_kernel import LegTables

GROWING, JOINED, EXHAUSTED = 0, 1, 2
"""What :func:`grow` returns."""

HALFWAY = 24
"""Milestones that are picked to be placed around the middle between start and goal, before trees grow at milestones."""
AROUND = 2.0
"""Half size of the box that they are placed in [ρ]."""
DRAWS = 6
"""Places tried for one of them; each second one is opposite to the one before, as beside a rock."""
SHRINKS = 64
"""Radii ρ/1 … ρ/64 tried around one milestone before another is picked."""
DIVISIONS = 16
"""Cells of the density grid along each of its two coordinates."""
REPICK = 64
"""Milestones after which the density grid changes to two other coordinates."""
TURNS = 0.5
"""Share of the picks after those that are spent on a turn of the first joint alone, …"""
MOST_TURNS = 0.1
"""… while no larger share of the milestones is ends of such turns: where they are easy to find, they are not needed."""
PITCHES = (1, 2, 4)
"""Joints that fold the leg."""
COARSE = 0.7
"""Pieces of a route that are longer are looked at in their middles alone, which mostly shows what is blocked; shorter
ones are proven as far as each look allows [rad]."""
PICKS = 4
"""Milestones may be picked this many times as often as the bound on them says; a pick may place none."""

COUNT, PICKED, AXIS_A, AXIS_B, BRIDGE_A, BRIDGE_B, TURNED = range(7)
"""Entries of ``Trees.numbers``."""


class Trees(NamedTuple):
    """Room for n milestones, and one more as some come in pairs; 0 is the start, 1 the goal.

    q: (n, 6) [rad]. side: (n,) 0 in the tree of the start, 1 of the goal. parent: (n,), −1 for the roots. level: (n,)
    halvings done of the segment to the parent. cell: (n,) of the density grid. tally: (2, cells) milestones of each
    tree in each cell. numbers: (7,), see COUNT to TURNED.
    """

    q: Array
    side: NDArray[np.int64]
    parent: NDArray[np.int64]
    level: NDArray[np.int64]
    cell: NDArray[np.int64]
    tally: NDArray[np.int64]
    numbers: NDArray[np.int64]


def planted(start: Array, goal: Array, milestones: int) -> Trees:
    """Trees of a start and a goal (6,) with room for so many milestones."""
    n = milestones + 3
    trees = Trees(
        q=np.empty((n, 6)),
        side=np.empty(n, np.int64),
        parent=np.empty(n, np.int64),
        level=np.empty(n, np.int64),
        cell=np.empty(n, np.int64),
        tally=np.zeros((2, DIVISIONS * DIVISIONS), np.int64),
        numbers=np.array([2, 0, 0, 1, -1, -1, 0]),
    )
    trees.side[:2], trees.parent[:2], trees.level[:2], trees.cell[:2] = (0, 1), -1, 0, 0
    trees.q[0], trees.q[1] = start, goal
    return trees


def route(trees: Trees) -> Array:
    """Waypoints (n, 6) from start to goal over the bridge of joined trees."""
    a, b = int(trees.numbers[BRIDGE_A]), int(trees.numbers[BRIDGE_B])
    if trees.side[a] != 0:
        a, b = b, a
    return trees.q[_to_root(trees, a)[::-1] + _to_root(trees, b)]


def _to_root(trees: Trees, milestone: int) -> list[int]:
    out = [milestone]
    while trees.parent[out[-1]] >= 0:
        out.append(int(trees.parent[out[-1]]))
    return out


@njit()
def grow(
    trees: Trees,
    rng: np.random.Generator,
    radius: float,
    epsilon: float,
    picks: int,
    clearance: LegTables,
    body: BodyTables,
    mode: int,
) -> int:
    """Pick up to ``picks`` milestones and grow the trees there; start and goal must be sure."""
    numbers = trees.numbers
    room = trees.q.shape[0] - 1
    if numbers[PICKED] == 0:
        _regrid(trees, rng, body)
        if _connected(trees, 0, epsilon, clearance, body, mode):
            return JOINED
    for _ in range(picks):
        if numbers[COUNT] >= room or numbers[PICKED] >= PICKS * room:
            return EXHAUSTED
        numbers[PICKED] += 1
        if _expanded(trees, rng, radius, epsilon, clearance, body, mode) and _connected(
            trees, numbers[COUNT] - 1, epsilon, clearance, body, mode
        ):
            return JOINED
    return GROWING


@njit()
def _expanded(
    trees: Trees,
    rng: np.random.Generator,
    radius: float,
    epsilon: float,
    clearance: LegTables,
    body: BodyTables,
    mode: int,
) -> bool:
    """EXPAND-TREE: a new sure milestone, halfway at first, then near a picked one, or two that a turn joins."""
    numbers, side = trees.numbers, int(rng.random() * 2)
    parent, new = side, numbers[COUNT]
    if numbers[PICKED] <= HALFWAY:
        placed = int(_placed_halfway(trees, rng, radius, clearance, body, mode))
    elif numbers[TURNED] < MOST_TURNS * new and rng.random() < TURNS:
        placed = 2 * _placed_to_turn(trees, rng, side, radius, epsilon, clearance, body, mode)
    else:
        parent = _pick(trees, rng, side)
        placed = int(_placed_near(trees, parent, rng, radius, clearance, body, mode))
    for i in range(new, new + placed):
        trees.side[i], trees.parent[i], trees.level[i] = side, parent, 0
        parent = i
    if placed == 2:
        numbers[TURNED] += 2
        trees.level[new + 1] = halvings(trees.q[new], trees.q[new + 1], epsilon)
    numbers[COUNT] = new + placed
    if numbers[COUNT] // REPICK > new // REPICK:
        _regrid(trees, rng, body)
    else:
        for i in range(new, new + placed):
            _enter_cell(trees, i, body)
    return placed > 0


@njit()
def _placed_halfway(
    trees: Trees, rng: np.random.Generator, radius: float, clearance: LegTables, body: BodyTables, mode: int
) -> bool:
    """Write a sure configuration around the middle between start and goal where the next milestone comes."""
    q, reach = trees.q[trees.numbers[COUNT]], AROUND * radius
    for draw in range(DRAWS):
        for k in range(6):
            middle = 0.5 * (trees.q[0, k] + trees.q[1, k])
            at = 2.0 * middle - q[k] if draw % 2 else middle + (2.0 * rng.random() - 1.0) * reach
            q[k] = min(max(at, body.lower[k]), body.upper[k])
        if is_sure(q, clearance, body, mode):
            return True
    return False


@njit()
def _placed_to_turn(
    trees: Trees,
    rng: np.random.Generator,
    side: int,
    radius: float,
    epsilon: float,
    clearance: LegTables,
    body: BodyTables,
    mode: int,
) -> bool:
    """Writes two configurations, all sure from one to the other.

    The first at the first angle of one root, the second at the other's, all else alike.
    """
    near, far = trees.q[trees.numbers[COUNT]], trees.q[trees.numbers[COUNT] + 1]
    root, other, reach = trees.q[side], trees.q[1 - side], AROUND * radius
    for _ in range(DRAWS):
        for k in range(1, 6):
            low, high = body.lower[k], body.upper[k]
            if k not in PITCHES:
                middle = 0.5 * (root[k] + other[k])
                low, high = max(low, middle - reach), min(high, middle + reach)
            near[k] = far[k] = low + rng.random() * (high - low)
        # mostly nothing is free half way, so it is looked at first
        far[0] = 0.5 * (root[0] + other[0])
        if not is_sure(far, clearance, body, mode):
            continue
        near[0], far[0] = root[0], other[0]
        if (
            is_sure(near, clearance, body, mode)
            and is_sure(far, clearance, body, mode)
            and edge_is_sure(near, far, epsilon, clearance, body, mode)
        ):
            return True
    return False


@njit()
def _placed_near(
    trees: Trees,
    picked: int,
    rng: np.random.Generator,
    radius: float,
    clearance: LegTables,
    body: BodyTables,
    mode: int,
) -> bool:
    """The same near a milestone, in boxes that shrink as ρ/1, ρ/2 and so on."""
    q = trees.q[trees.numbers[COUNT]]
    for shrink in range(1, SHRINKS + 1):
        reach = radius / shrink
        for k in range(6):
            low = max(body.lower[k], trees.q[picked, k] - reach)
            high = min(body.upper[k], trees.q[picked, k] + reach)
            q[k] = low + rng.random() * (high - low)
        if is_sure(q, clearance, body, mode):
            return True
    return False


@njit()
def _pick(trees: Trees, rng: np.random.Generator, side: int) -> int:
    """A milestone of one tree, from a filled cell at random: thinly covered regions are picked more often."""
    filled = 0
    for cell in range(trees.tally.shape[1]):
        filled += trees.tally[side, cell] > 0
    wanted = int(rng.random() * filled)
    chosen = -1
    for cell in range(trees.tally.shape[1]):
        if trees.tally[side, cell] > 0:
            if wanted == 0:
                chosen = cell
                break
            wanted -= 1
    member = int(rng.random() * trees.tally[side, chosen])
    for i in range(trees.numbers[COUNT]):
        if trees.side[i] == side and trees.cell[i] == chosen:
            if member == 0:
                return i
            member -= 1
    return side  # each tree has its root


@njit()
def _enter_cell(trees: Trees, i: int, body: BodyTables) -> None:
    at = 0
    for axis in (trees.numbers[AXIS_A], trees.numbers[AXIS_B]):
        share = (trees.q[i, axis] - body.lower[axis]) / max(body.upper[axis] - body.lower[axis], 1e-12)
        at = at * DIVISIONS + min(max(int(share * DIVISIONS), 0), DIVISIONS - 1)
    trees.cell[i] = at
    trees.tally[trees.side[i], at] += 1


@njit()
def _regrid(trees: Trees, rng: np.random.Generator, body: BodyTables) -> None:
    """Lay the density grid over two other coordinates."""
    a, b = int(rng.random() * 6), int(rng.random() * 5)
    trees.numbers[AXIS_A], trees.numbers[AXIS_B] = a, b + (b >= a)
    _recount(trees, body)


@njit()
def _recount(trees: Trees, body: BodyTables) -> None:
    trees.tally[:] = 0
    for i in range(trees.numbers[COUNT]):
        _enter_cell(trees, i, body)


@njit()
def _distance(a: Array, b: Array) -> float:
    away = 0.0
    for k in range(a.size):
        away = max(away, abs(a[k] - b[k]))
    return away


@njit()
def _connected(trees: Trees, newest: int, epsilon: float, clearance: LegTables, body: BodyTables, mode: int) -> bool:
    """CONNECT-TREES: bridge a milestone to the closest of the other tree, and TEST-PATH."""
    other, least = -1, np.inf
    for i in range(trees.numbers[COUNT]):
        if trees.side[i] != trees.side[newest]:
            away = _distance(trees.q[i], trees.q[newest])
            if away < least:
                other, least = i, away
    trees.numbers[BRIDGE_A], trees.numbers[BRIDGE_B] = newest, other
    q, bridge_level = np.empty(6), 0
    while True:
        # the segment whose unchecked pieces are longest; −1 stands for the bridge
        worst, length = -2, 0.0
        if halvings(trees.q[newest], trees.q[other], epsilon) > bridge_level:
            worst, length = -1, least / 2**bridge_level
        for end in (newest, other):
            i = end
            while trees.parent[i] >= 0:
                a, b = trees.q[i], trees.q[trees.parent[i]]
                pieces = _distance(a, b) / 2 ** trees.level[i]
                if pieces > length and halvings(a, b, epsilon) > trees.level[i]:
                    worst, length = i, pieces
                i = trees.parent[i]
        if worst == -2:
            return True
        first, second = (newest, other) if worst == -1 else (worst, trees.parent[worst])
        a, b = trees.q[first], trees.q[second]
        level = (bridge_level if worst == -1 else trees.level[worst]) + 1
        if length <= COARSE:
            level = halvings(a, b, epsilon)
            passes = edge_is_sure(a, b, epsilon, clearance, body, mode)
        else:
            passes = level_is_sure(a, b, level, q, clearance, body, mode)
        if worst == -1:
            bridge_level = level
            if not passes:
                return False
        else:
            trees.level[worst] = level
            if not passes:
                _hand_over(trees, worst, newest, other, bridge_level)
                _recount(trees, body)
                return False


@njit()
def _hand_over(trees: Trees, blocked: int, newest: int, other: int, bridge_level: int) -> None:
    """Take the segment from ``blocked`` to its parent out; what hangs behind it passes over the bridge."""
    end, beyond = (newest, other) if trees.side[blocked] == trees.side[newest] else (other, newest)
    before, level, i = beyond, bridge_level, end
    while True:
        following, its_level = trees.parent[i], trees.level[i]
        trees.parent[i], trees.level[i] = before, level
        if i == blocked:
            break
        before, level, i = i, its_level, following
    for i in range(trees.numbers[COUNT]):
        root = i
        while trees.parent[root] >= 0:
            root = trees.parent[root]
        trees.side[i] = root
