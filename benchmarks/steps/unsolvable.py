"""Why a problem has no solution: proofs that ask no planner.

*Out of reach*: no point of a wheel is farther from the leg's first joint than the leg's lengths and the way from the
wheel's middle to its rim's edge together; the footfall is.

*Shut in*: where the first link of a leg is depends on the first joint alone, where the second is on the first two. If
at an angle of the first joint its link collides with what does not move, or the second link does at every angle of the
second joint, no posture with that angle is free. A path is continuous, so from the start it can't get past such an
angle. If every posture that stands on the target has the first joint past one, there is no way to any. Pieces of the
second joint's range are halved until the second link lacks more of its distance in the middle of each than it can move
from there.
"""

import numpy as np

from benchmarks.steps.problem import Scene, StepProblem
from benchmarks.steps.search import Posed
from footfall.planning.scene.ground import Contact, footfall_contact
from footfall.planning.step.situation import NO_GROUND
from footfall.robot.description import PARTS, link_name
from footfall.robot.meshes.collision import CollisionScene

_LOOKS = 0.02
"""Between two angles of the first joint that are looked at [rad]: one that is blocked is enough."""
_PIECES = 16
"""Of the second joint's angles; one whose middle is free is enough to leave an angle of the first joint."""
_SHORTEST = 1e-4
"""Half a piece that is not halved again [rad]."""


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
    """Where the first links are blocked, or None where some goal is not proven to lie past such an angle."""
    scene, leg = posed.scene, posed.leg
    meshes = CollisionScene(scene.robot, scene.state.posture, leg, scene.state.T_site_base, None, 0.0)
    names, own = [link_name(leg, part) for part in PARTS[:2]], f"leg{leg}_"
    reach = float(np.linalg.norm(scene.robot.description.meshes[names[1]].vertices, axis=1).max())
    low, high = (float(limits[6 * leg + 1]) for limits in (scene.robot.lower, scene.robot.upper))

    def lacking(angle: float, pitch: float) -> float:
        """What the second link lacks at most of its distances [m]; infinite where the first is blocked, 0: free."""
        q = posed.up[-1].copy()
        q[:2] = angle, pitch
        hits = [hit for hit in meshes.contacts(q, NO_GROUND) if not hit.link_b.startswith(own)]
        if any(hit.link_a == names[0] for hit in hits):
            return np.inf
        return max((hit.required - max(hit.distance, 0.0) for hit in hits if hit.link_a == names[1]), default=0.0)

    def covered(angle: float, middle: float, half: float) -> bool:
        lacks = lacking(angle, middle)
        if lacks > reach * half:
            return True
        halves = (middle - half / 2, middle + half / 2)
        return lacks > 0.0 and half > _SHORTEST and all(covered(angle, one, half / 2) for one in halves)

    def blocked(angle: float) -> str:
        if np.isinf(lacking(angle, float(posed.up[-1][1]))):
            return "link is"
        edges = np.linspace(low, high, _PIECES + 1)
        middles, half = (edges[1:] + edges[:-1]) / 2, (edges[1] - edges[0]) / 2
        if all(lacking(angle, float(one)) > 0.0 for one in middles) and all(
            covered(angle, float(one), float(half)) for one in middles
        ):
            return "two links are"
        return ""

    start = float(posed.up[-1][0])
    goals = {round(float(down[-1][0]), 6) for down in posed.downs}
    past, whats = [], set[str]()
    for side in (-1, 1):
        beyond = [abs(goal - start) for goal in goals if np.sign(goal - start) == side]
        if not beyond:
            continue
        angles = (float(angle) for angle in start + side * np.arange(_LOOKS, min(beyond), _LOOKS))
        found = next(((angle, what) for angle in angles if (what := blocked(angle))), None)
        if found is None:
            return None
        past.append(f"{found[0]:.2f}")
        whats.add(found[1])
    return (
        f"proof: between start and all {len(posed.downs)} goals the first {max(whats)} blocked, "
        f"at {' and '.join(past)} rad"
    )
