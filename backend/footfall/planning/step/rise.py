"""Whether a leg may move straight up, and what forbids it."""

import itertools

from footfall.core.arrays import Array
from footfall.planning.step.search.edges import Space
from footfall.planning.step.situation import RAISED, TRUE, Situation
from footfall.planning.watch import Watch


def space_of(situation: Situation, watch: Watch, terrain: str) -> Space:
    """The space of the leg over the ground as it is (TRUE) or raised for the swing (RAISED)."""
    certificate, epsilon = situation.footing.certificate, situation.settings.epsilon
    return Space(
        situation.lower,
        situation.upper,
        lambda q: situation.free(q, terrain),
        epsilon,
        watch.tick,
        lambda qs: certificate.first_unsure(qs, terrain),
        lambda path: certificate.edges_sure(path, epsilon, terrain),
    )


def rises(situation: Situation, watch: Watch, up: Array) -> bool:
    """Whether a vertical move is free, and its upper end as the start of a swing.

    Args:
        situation: what the leg may do.
        watch: progress and time limit.
        up: postures of the leg, (n, 6) [rad].

    Returns:
        True where both are.
    """
    return space_of(situation, watch, TRUE).path_is_free(up) and space_of(situation, watch, RAISED).is_free(up[-1])


def blocked_rise(situation: Situation, watch: Watch, up: Array) -> str:
    """What forbids a vertical move that does not pass, with its height.

    Args:
        situation: what the leg may do.
        watch: progress and time limit.
        up: postures of the leg, (n, 6) [rad].

    Returns:
        One sentence.
    """
    space = space_of(situation, watch, TRUE)
    height = situation.settings.lift / (len(up) - 1)
    for i, q in enumerate(up):
        if not space.is_free(q):
            return f"{i * height:z.2f} m above the ground {situation.objection(q, TRUE)}"
    for i, (a, b) in enumerate(itertools.pairwise(up)):
        t = None if space.edge_is_free(a, b) else space.first_blocked(a, b)
        if t is not None:
            return f"{(i + t) * height:z.2f} m above the ground {situation.objection(a + t * (b - a), TRUE)}"
    return f"{situation.settings.lift:z.2f} m above the ground {situation.objection(up[-1], RAISED)}"
