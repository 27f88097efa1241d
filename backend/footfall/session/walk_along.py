"""What there is to say all along a walk of a session, beside its margins and torques.

What measures it loads compiled code, so it loads when first asked.
"""

import numpy as np

from footfall.core.errors import Conflict
from footfall.planning.walk.problem import WalkResult
from footfall.session.answers.walks import AlongWalkAnswer, PartSpareAnswer
from footfall.session.live import LiveSession
from footfall.session.products.snapshot_age import seen_at
from footfall.terrain.dem import Dem


def along_walk(live: LiveSession, digest: str, result: WalkResult) -> AlongWalkAnswer:
    """Of a walk, or of as far as one got, over the terrain that it was planned on. Raises Conflict without one."""
    from footfall.planning.walk.spare_along import PartSpare, seen_before, spare_along

    plan = result.plan or result.partial
    if plan is None:
        raise Conflict(f"there is no walk, so nothing comes near anything: {result.reason}", digest=digest)
    dem = live.typed(Dem, result.provenance.parents["dem"])

    def answer_of(part: PartSpare) -> PartSpareAnswer:
        spare = float(part.spare) if np.isfinite(part.spare) else None
        return {
            "first": part.first,
            "last": part.last,
            "spare": spare,
            "waypoint": part.waypoint,
            "between": part.between,
        }

    known = dem.time is not None and bool(np.isfinite(dem.time).any())
    return {
        "digest": digest,
        "parts": [answer_of(part) for part in spare_along(live.robot, dem, plan)],
        # by this computer's clock: that of the rover may have begun with it
        "newest": seen_at(live, dem.digest) if known else None,
        "seen_before": seen_before(live.robot, dem, plan),
    }
