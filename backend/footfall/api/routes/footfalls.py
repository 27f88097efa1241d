"""Choosing where a wheel is to touch, and finding the point on the ground under a line of sight."""

from typing import TypedDict

import numpy as np

from footfall.api.access import OneSession, product
from footfall.api.bodies.schemas import FootfallChoice, Ray
from footfall.api.routing import Routes
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.session.answers.choices import FootfallAnswer
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import pick

router = Routes(tags=["footfalls"])


class Picked(TypedDict):
    """Site frame [m]."""

    point: Array | None


@router.post("/sessions/{session}/footfalls")
def choose(live: OneSession, choice: FootfallChoice) -> FootfallAnswer:
    """Choose a footfall. The answer says what is known of the ground there and, if it is not acceptable, why."""
    return live.maps.choose_footfall(choice.leg, choice.x, choice.y)


@router.post("/sessions/{session}/pick")
def pick_point(live: OneSession, ray: Ray) -> Picked:
    """Where a ray first meets the terrain's triangles; null where it meets none."""
    direction = np.array(ray.direction)
    if not direction.any():
        raise InvalidInput("a ray needs a direction that is not zero")
    return {"point": pick(product(live, "current", Dem, live.state.dem), np.array(ray.origin), direction)}
