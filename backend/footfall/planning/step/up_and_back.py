"""A step onto the very place where the wheel stands on unknown ground: straight up, and back the same way.

That ground bears the wheel now, so joint for joint the leg may come back to where it was lifted from; nothing more is
believed of it. While it is up, cameras see what the wheel hides (:mod:`footfall.planning.looking`).
"""

from footfall.maps.standing import contacts
from footfall.maps.support_outlines import bearing
from footfall.planning.scene.ground import Contact
from footfall.planning.step.footing import LegStance
from footfall.planning.step.problem import Footfall

SAME = 0.02
"""A footfall so near to where the wheel touches is that place [m]: an operator's click, or two decimals."""


def where_it_stands(stance: LegStance, footfall: Footfall) -> Contact | None:
    """What a leg's wheel touches now, where it bears and the footfall is that place; else None.

    Args:
        stance: who stands where.
        footfall: what was asked for.

    Returns:
        The contact; of ground that is not known the normal is taken as vertical.
    """
    robot, state, leg = stance.robot, stance.state, stance.leg
    if leg not in bearing(robot, state):
        return None
    found = contacts(robot, stance.dem, state.posture, state.T_site_base, [leg])
    point = found.points[0]
    if (point[0] - footfall.x) ** 2 + (point[1] - footfall.y) ** 2 > SAME**2:
        return None
    return Contact(point, found.normals[0])
