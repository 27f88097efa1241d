"""How much of the ground under a tether's way nobody has seen."""

import numpy as np

from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.answers import Check
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

LOOKED_AT = 0.05
"""Between places at which the ground under a tether is looked at [m]."""


def unknown_under(dem: Dem, tether: Tether, Ts_site_base: Array) -> tuple[Check, ...]:
    """Unknown ground under the tether of a chassis.

    Where the tether may lie by its anchor is not looked at. Never a reason to refuse, but to be told, as it is of a
    leg's way: holes are planned over as if they were as high as their highest known neighbour.

    Args:
        dem: the ground, in site.
        tether: that the rover hangs on; None: none.
        Ts_site_base: poses of the chassis, (n, 4, 4).

    Returns:
        A check; none where all is known.
    """
    poses, under, unknown = np.asarray(Ts_site_base, float), 0, []
    for T, length in zip(poses, tether.lengths(poses), strict=True):
        first = min(tether.bare / length, 1.0)
        shares = np.linspace(first, 1.0, 2 + int((1.0 - first) * length / LOOKED_AT))
        places = (tether.anchor + shares[:, None] * (apply(T, tether.attachment) - tether.anchor))[:, :2]
        under += len(places)
        unknown.append(places[~np.isfinite(height_at(dem, places[:, 0], places[:, 1]))])
    found = np.concatenate(unknown)
    if not len(found):
        return ()
    x, y = found[0]
    text = (
        f"{len(found) / under:.1%} of what is below its way, first at ({x:z.2f}, {y:z.2f}) m; taken as high as its "
        "highest known neighbour: a rock there is not known of"
    )
    return (Check("unknown ground under the tether", True, float("nan"), "", text),)
