"""The posture at which a gait fails: that it was to take, whether or not its checks hold there."""

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.walk.body_way import At
from footfall.planning.walk.legs_kernel import leg_at
from footfall.planning.walk.problem import Stance
from footfall.planning.walk.world import World


def posture_over(world: World, at: At, stance: Stance, T_site_base: Array) -> Array:
    """Joints with the chassis at a pose over the feet of a stance, without any reserve.

    Joint limits don't count, as they may be what fails.

    Args:
        world: rover, ground and settings of the walk.
        at: where the rover is.
        stance: where the feet are to be.
        T_site_base: pose of the chassis, (4, 4).

    Returns:
        (legs × 6,) [rad]; a leg that does not reach keeps the joints that it has ``at``.
    """
    free = world.legs._replace(
        reach_reserve=0.0,
        joint_reserve=-np.inf,
        wrist=-np.inf,
        knee_roll=np.inf,
        lower=np.full_like(world.legs.lower, -np.inf),
        upper=np.full_like(world.legs.upper, np.inf),
    )
    T, posture = np.ascontiguousarray(T_site_base[:3]), np.array(at.posture)
    for leg in world.robot.legs:
        q = posture[6 * leg : 6 * leg + 6].copy()
        wheel = np.ascontiguousarray(stance.Ts_site_wheel[leg, :3])
        leg_at(T, wheel, int(stance.branches[leg]), leg, free, q)
        if np.isfinite(q).all():
            posture[6 * leg : 6 * leg + 6] = q
    return posture
