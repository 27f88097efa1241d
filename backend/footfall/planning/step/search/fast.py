"""The compiled planner: SBL and shortcuts over postures that are surely free.

Start and goal are free, but may be too near to something to be surely so. Then the search begins at a surely free
posture beside them, which a mesh-checked edge joins to them.
"""

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.joint_path import length
from footfall.planning.scene.certificate import Certificate
from footfall.planning.step.search.edges import Space
from footfall.planning.step.search.sbl_kernel import COUNT, GROWING, JOINED, Trees, grow, planted, route
from footfall.planning.step.search.shortcut_kernel import shortened
from footfall.robot.proof.leg_clearance_kernel import RAISED_GROUND

SEARCHES, MOST_SEARCHES = 2, 6
"""Paths that are looked for; the one that is shortest after a little shortening is shortened on. More than the first
number only while that one is a detour and paths are easily found."""
DETOUR = 1.6
"""So many times as long as the straight line."""
EASILY = 100
"""With so many milestones."""
FIRST_TRIES, TRIES = 30, 200
"""Places for shortcuts that are drawn of each path, and of the shortest; those that would save next to nothing cost
next to nothing."""
_PICKS = 64
"""Milestones picked between two looks at the clock."""
_ESCAPES = np.repeat((0.02, 0.05, 0.1, 0.2, 0.4), 20)
"""Half sizes of the boxes around an unsure end in which a sure posture is looked for [rad]."""


def fast(
    space: Space, certificate: Certificate, start: Array, goal: Array, *, radius: float, milestones: int, seed: int
) -> Array | str:
    """Waypoints over raised ground, shortened.

    The same arguments give the same waypoints in any process.

    Args:
        space: what is free.
        certificate: proofs that it is.
        start: (6,) [rad], free.
        goal: (6,) [rad], free.
        radius: of a step of the trees, at most [rad].
        milestones: configurations that they have room for.
        seed: of what is drawn.

    Returns:
        (n, 6) [rad], or why there are none.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    ends = []
    for q, name in ((start, "start"), (goal, "goal")):
        sure = escaped(space, q, rng)
        if sure is None:
            return f"the swing's {name} is too narrow for the compiled check"
        ends.append(sure)
    checks = space.epsilon, certificate.clearance, certificate.body, RAISED_GROUND
    straight, found = length(np.array(ends)), []
    for number in range(MOST_SEARCHES):
        trees = searched(space, certificate, ends[0], ends[1], rng, radius, milestones)
        if trees is None:
            break
        found.append(shortened(route(trees), rng, FIRST_TRIES, *checks))
        detour = length(min(found, key=length)) > DETOUR * straight
        if number + 1 >= SEARCHES and not (detour and trees.numbers[COUNT] <= EASILY):
            break
    if not found:
        return f"the compiled SBL picked and placed up to {milestones} milestones without joining them"
    path = shortened(min(found, key=length), rng, TRIES, *checks)
    before = [] if np.array_equal(path[0], start) else [start]
    after = [] if np.array_equal(path[-1], goal) else [goal]
    return np.array([*before, *path, *after])


def compile_search(certificate: Certificate) -> None:
    """Compile the search, or load it compiled, where this process has not yet."""
    if not shortened.signatures:
        ends, rng = np.zeros((2, 6)), np.random.default_rng(0)
        checks = certificate.clearance, certificate.body, RAISED_GROUND
        grow(planted(ends[0], ends[1], 1), rng, 1.0, 1.0, 0, *checks)
        shortened(ends, rng, 0, 1.0, *checks)


def searched(
    space: Space,
    certificate: Certificate,
    start: Array,
    goal: Array,
    rng: np.random.Generator,
    radius: float,
    milestones: int,
) -> Trees | None:
    """The trees of a start and a goal, once they are joined.

    Args:
        space: what is free.
        certificate: proofs that it is.
        start: (6,) [rad], sure.
        goal: (6,) [rad], sure.
        rng: what draws.
        radius: of a step of the trees, at most [rad].
        milestones: configurations that they have room for.

    Returns:
        The trees; None where they could not be joined.
    """
    trees = planted(start, goal, milestones)
    outcome = GROWING
    while outcome == GROWING:
        space.tick(_PICKS)
        outcome = grow(
            trees, rng, radius, space.epsilon, _PICKS, certificate.clearance, certificate.body, RAISED_GROUND
        )
    return trees if outcome == JOINED else None


def escaped(space: Space, q: Array, rng: np.random.Generator) -> Array | None:
    """The posture itself where it is sure, or a sure one beside it that a free edge joins to it.

    Args:
        space: what is free.
        q: the posture, (6,) [rad].
        rng: what draws.

    Returns:
        (6,) [rad]; None where there is no such one.
    """
    if space.is_sure(q):
        return q
    for reach in _ESCAPES:
        beside = rng.uniform(np.maximum(space.lower, q - reach), np.minimum(space.upper, q + reach))
        if space.is_sure(beside) and space.edge_is_free(q, beside):
            return beside
    return None
