"""Whether the rover can be where its state says: a plan from a fiction is worth nothing.

Said before any search: every joint inside its limits, no standing leg cutting into another or into the chassis, every
other wheel on the ground that is to carry the rover, and neither chassis nor a standing leg below the ground. The leg
that is to move is looked at more closely by the situation. Where the ground is unknown nothing is said. Standing legs
may be nearer to each other than a moving one may come: the rover can stand so, and no step of another leg changes it.
"""

from functools import lru_cache

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.mesh import Mesh
from footfall.maps.standing import STANDING_GAP, wheel_gaps
from footfall.planning.latest_results import LatestResults
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.collision import Collision, posture_collisions
from footfall.robot.meshes.depth import overlap
from footfall.robot.meshes.ground import surface_points
from footfall.robot.model import Robot
from footfall.robot.tolerance import outside_in_words
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

ADVICE = "correct the state or the terrain, or put the legs down first"
SPACING = 0.1
"""How densely the links' surfaces are compared with the ground [m]."""


def start_objection(robot: Robot, dem: Dem, state: RobotState, leg: int) -> str:
    """What makes the state impossible on this ground for a step of ``leg``, and what to do; empty where nothing."""
    return (
        _outside_limits(robot, state)
        or _cutting(robot, state, leg)
        or _not_on_the_ground(robot, dem, state, [other for other in robot.legs if other != leg])
        or _below_the_ground(robot, dem, state, leg)
    )


def _outside_limits(robot: Robot, state: RobotState) -> str:
    outside = outside_in_words(robot, np.asarray(state.posture))
    return f"{outside}, or correct its encoder if the joint is not really there" if outside else ""


def _cutting(robot: Robot, state: RobotState, moving: int) -> str:
    """What stands cuts into what else stands: the deepest pair, and how many there are."""
    own = {link_name(moving, part) for part in PARTS}
    cuts = [hit for hit in _cuts(robot, state) if hit.link_a not in own and hit.link_b not in own]
    if not cuts:
        return ""
    depths = [overlap(robot, np.asarray(state.posture), hit.link_a, hit.link_b) for hit in cuts]
    worst = cuts[int(np.argmax(depths))]
    more = f", and {len(cuts) - 1} more pairs of links do" if len(cuts) > 1 else ""
    return (
        f"{worst.link_a} cuts up to {max(depths):z.3f} m into {worst.link_b}{more}; neither moves in this step: "
        "correct the encoders of these legs"
    )


_KEPT_POSTURES = 4
_kept_cuts: LatestResults[tuple[Collision, ...]] = LatestResults(_KEPT_POSTURES)


def _cuts(robot: Robot, state: RobotState) -> tuple[Collision, ...]:
    """Every pair of the rover's links that cut each other; found once for all steps from a posture."""

    def found() -> tuple[Collision, ...]:
        return tuple(hit for hit in posture_collisions(robot, state.posture, state.T_site_base) if hit.distance <= 0)

    return _kept_cuts.get((robot.digest, np.asarray(state.posture).tobytes()), found)


def _not_on_the_ground(robot: Robot, dem: Dem, state: RobotState, legs: list[int]) -> str:
    """The supporting wheels that hang over the ground or are farther in it than they can sink."""
    deepest = robot.description.clearances.wheel_sink + STANDING_GAP
    found = []
    for leg, gap in zip(legs, wheel_gaps(robot, dem, state.posture, state.T_site_base, legs), strict=True):
        if gap > STANDING_GAP:
            found.append(f"the wheel of leg {leg} is to carry the rover but is {gap:z.2f} m above the ground")
        elif gap < -deepest:
            found.append(f"the wheel of leg {leg} is {-gap:z.2f} m in the ground")
    return f"{' and '.join(found)}; {ADVICE}" if found else ""


def _below_the_ground(robot: Robot, dem: Dem, state: RobotState, moving: int) -> str:
    """The link, wheels apart, whose surface is deepest under the ground."""
    parts = [part for part in PARTS if part != "wheel"]
    links = ["base", *(link_name(leg, part) for leg in robot.legs if leg != moving for part in parts)]
    poses = link_poses(robot, state.posture)
    T_site_base = np.asarray(state.T_site_base)
    surfaces = [apply(T_site_base @ poses[link], _surface(robot.description.meshes[link])) for link in links]
    points = np.concatenate(surfaces)
    depth = height_at(dem, points[:, 0], points[:, 1]) - points[:, 2]
    deepest = int(np.argmax(np.where(np.isfinite(depth), depth, -np.inf)))
    if not depth[deepest] > STANDING_GAP:
        return ""
    ends = np.cumsum([len(surface) for surface in surfaces])
    name = links[int(np.searchsorted(ends, deepest, side="right"))]
    return f"{name} is {depth[deepest]:z.2f} m below the ground; {ADVICE}"


def _surface(mesh: Mesh) -> Array:
    return _points(mesh.vertices.tobytes(), mesh.triangles.tobytes())


@lru_cache(maxsize=64)
def _points(vertices: bytes, triangles: bytes) -> Array:
    mesh = Mesh(np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(triangles, np.int32).reshape(-1, 3))
    return surface_points(mesh, SPACING)
