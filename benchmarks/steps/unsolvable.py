"""Why a problem has no solution: proofs that ask no planner.

*Out of reach*: no point of a wheel is farther from the leg's first joint than the leg's lengths and the way from the
wheel's middle to its rim's edge together; the footfall is.

*Shut in*: where the first link of a leg is depends on the first joint alone. If at an angle of that joint the link
collides with what does not move, no posture with that angle is free. A path is continuous, so from the start it can't
get past such an angle. If every posture that stands on the target has the first joint past one, there is no way to any.
"""

import numpy as np

from benchmarks.steps.problem import Scene, StepProblem
from benchmarks.steps.search import Posed
from footfall.planning.step.ground import Contact, footfall_contact
from footfall.planning.step.situation import NO_GROUND
from footfall.robot.collision import CollisionScene
from footfall.robot.description import link_name

_LOOKS = 0.02
"""Between two angles of the first joint that are looked at [rad]: one that is blocked is enough."""


def out_of_reach(problem: StepProblem, scene: Scene) -> str | None:
    """How far the footfall is, or None where it is not too far or no footfall at all."""
    robot, leg = scene.robot, problem.leg
    contact = footfall_contact(robot, scene.dem, *problem.target)
    if not isinstance(contact, Contact):
        return None
    hip = (np.asarray(scene.state.T_site_base) @ robot.description.legs[leg].T_base_hip)[:3, 3]
    away, longest = float(np.linalg.norm(contact.point - hip)), farthest(scene, leg)
    return f"proof: {away:.3f} m from the hip, the leg is {longest:.3f} m long" if away > longest else None


def farthest(scene: Scene, leg: int) -> float:
    """No point of the wheel is farther from the leg's first joint [m]."""
    description = scene.robot.description
    wheel = description.meshes[link_name(leg, "wheel")].vertices
    return float(description.legs[leg].reaches[-1] + np.linalg.norm(wheel, axis=1).max())


def shut_in(posed: Posed) -> str | None:
    """Where the first link is blocked, or None where some goal is not proven to lie past such an angle."""
    scene, leg = posed.scene, posed.leg
    meshes = CollisionScene(scene.robot, scene.state.posture, leg, scene.state.T_site_base, None, 0.0)
    first, own = link_name(leg, "hip_yaw"), f"leg{leg}_"

    def blocked(angle: float) -> bool:
        q = posed.up[-1].copy()
        q[0] = angle
        hits = meshes.contacts(q, NO_GROUND)
        return any(hit.link_a == first and not hit.link_b.startswith(own) for hit in hits)

    start = float(posed.up[-1][0])
    goals = {round(float(down[-1][0]), 6) for down in posed.downs}
    past = []
    for side in (-1, 1):
        beyond = [abs(goal - start) for goal in goals if np.sign(goal - start) == side]
        if not beyond:
            continue
        angles = start + side * np.arange(_LOOKS, min(beyond), _LOOKS)
        found = next((float(angle) for angle in angles if blocked(float(angle))), None)
        if found is None:
            return None
        past.append(f"{found:.2f}")
    return (
        f"proof: between start and all {len(posed.downs)} goals the first link is blocked, at {' and '.join(past)} rad"
    )
