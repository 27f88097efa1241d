"""Ways over a grid of costs cut short where a straight line is no dearer; points moved to the cheapest places."""

from footfall.core.arrays import Array
from footfall.planning.route.line_kernel import line_costs, settle_points, shortcuts

_ROUNDS = 2
"""Times that a way is cut short and its corners are moved."""
_WORTH_A_ROUND = 1e-3
"""Share of the cost; where the last round saved less, another one saves next to nothing."""
_STEP = 0.5
"""A corner is moved by so much at first [edges]."""


def straightened(costs: Array, way: Array) -> tuple[Array, Array]:
    """The shorter way (n, 2), (row, column) in edges, and what its parts cost (n − 1,) [edges].

    costs: with a border, see corners_kernel.
    """
    own = line_costs(costs, way)
    for _ in range(_ROUNDS):
        before = own.sum()
        way = way[shortcuts(costs, way, own)]
        own = line_costs(costs, way)
        settle_points(costs, way, own, _STEP)
        if own.sum() > before * (1.0 - _WORTH_A_ROUND):
            break
    return way, own
