"""A fast check of one moving leg that is sure where it says free: compiled, microseconds for a configuration.

:class:`LegClearance` answers "certified free" or "unsure" for the same leg, stance, ground and distances as
:class:`~footfall.robot.meshes.collision.CollisionScene`. Certified free implies that the exact check says free. That is
proven, not sampled:

1. *Links.* Each link is inside a convex shell (shells.py). Two links are certified only by a direction in which their
   shells are at least the required distance apart (separation.py). The checked pairs are those of CollisionScene. One
   shell cannot be inside another that it is apart from, so this is more than the exact check of surfaces asks.
2. *Ground.* Each part's surface is covered by balls (cover.py). Let a ball have radius ρ and the part the required
   distance δ. It is certified where a ball of radius ρ + δ around the same point is clear of the ground
   and has no ground above it (ground_tables.py). A point of the part's surface lies in a certified ball, at most ρ from
   its middle, and every point of the ground is at least ρ + δ from that middle, so they are at least δ apart.
3. *Below the ground.* The exact check also says no where the middle m of a part has ground above it within the
   part's inner ball (ground.py), so the ground's point s is beside a point x at the height of m inside the closed mesh.
   The vertical line down from x leaves the mesh at a point y of its surface, in a certified ball with middle p.
   Ground in the column of y is below the lower half of the ball of radius ρ + δ around p, and y is not:
   s_z ≤ p_z − √((ρ + δ)² − d²) ≤ p_z − √(ρ² − d²) ≤ y_z ≤ x_z = m_z, with d the horizontal distance of y and p.
   So the exact check finds nothing below the ground either.

4. *Motion.* ``leg_stays_clear`` says the same of every joint vector within given turns of one. A joint that turns by Δ
   moves a point by at most Δ times the point's distance from the axis, and the joints beyond it change that distance by
   no more than they move the point; summed from the wheel inward that bounds by how much, m, a point of each part moves
   (Schwarzer, Saha & Latombe, IEEE Trans. Robotics 21, 2005, §III). Links that are m farther apart than required stay
   apart as required. A ball of radius ρ + δ moved by at most m stays inside the ball of radius ρ + δ + m around where
   it was; where that is clear of the ground with none above, so is the moved one, and 2 and 3 hold at the other joint
   vector as well.
   Tables exist for some radii only. Let the middle be too low by e > 0 for the next larger one, R: every point of the
   ground within R of it, seen from above, is at z ≤ p_z + e − √(R² − d²). For r ≤ R and d ≤ r, √(R² − d²) − √(r² − d²)
   is least at d = 0, where it is R − r. So where e ≤ R − r the ground is at z ≤ p_z − √(r² − d²): the ball of radius
   r is clear, with none above. What a table of larger balls says of smaller ones is used for motion alone.

5. *Lines.* ``leg_span_kernel`` says how far along a straight line q + s d the leg is clear. A point x that joints with
   axes a through points o turn has the velocity Σ dᵢ aᵢ × (x − oᵢ): no point of a part is faster than the part's
   middle and the part's turning times its reach together. The second derivative of x is Σᵢⱼ dᵢ dⱼ aₖ × (aₘ × (x −
   oₘ)), k the smaller and m the larger of i and j, at most Σᵢⱼ |dᵢ dⱼ| |x − oₘ|, and |x − oₘ| is at most what the
   links between measure, in any posture. So x moves by at most v s + b s², v the most speed at q and b half of that
   sum, and by at most Σ |dᵢ| |x − oᵢ| s; 4 holds with either as m. Two parts of the leg are seen from the one nearer
   to the hip: only the joints between move the other. The smallest s that a pair or a ball allows is the answer. The
   centre of mass moves likewise, and so does its margin (planning/scene/leg_free_kernel.py).

6. *The wheel as a drum* (drum_kernel.py), asked for with ``drum`` and only where a small ball of the wheel is unsure:
   on steep ground a table for balls is too high by what the ground rises over two of its cells, and the balls stick out
   of the wheel. The wheel is inside its shell, a drum D; a block of the ground is inside the hull of its four corners
   v, a triangle inside that of its three. Let n be a unit vector that does not point upward, and g the least n · v of
   the corners less the largest n · x of D. Then n · (s − x) ≥ g for all s of the block and x of D. Where g ≥ δ > 0
   they are at least δ apart, and no s is above an x in its column, as n · (s − x) would be n_z (s_z − x_z) ≤ 0: nothing
   is below the ground, so 2 and 3 hold. Every block is looked at whose square comes within δ of the box around D seen
   from above, but those more than δ below D, which are apart from it and not above it either. Moved by at most m, D
   keeps g − m, so 4 and 5 hold with g − δ as the room. Ground is known as far as MOST beyond δ; no more room is told.

The wheel in mode "true" is the smaller wheel of the exact check with δ = 0. Unknown ground is no obstacle, as there.
Every distance is required with SLACK more. That is above what the two computations may differ by: rounding, the
exact check's tolerance (1e-6 m), and an orientation of the base that is orthogonal to 1e-6 only (see
``require_transform``), which moves points 3 m away by up to 1e-5 m. In the other direction nothing is promised: what
is unsure may be free.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.arrays import Array
from footfall.core.bounds import require_distances
from footfall.core.errors import InvalidInput
from footfall.core.frames import require_transform
from footfall.core.grid import GridGeometry
from footfall.robot.description import PARTS, RobotDescription, link_name
from footfall.robot.kinematics import leg_link_poses
from footfall.robot.leg_frames import leg_lengths
from footfall.robot.meshes.bvh import PAYLOAD, TOUCHING_WHEEL, robot_meshes
from footfall.robot.model import Robot
from footfall.robot.proof.cover import BallTree, ball_tree
from footfall.robot.proof.drum_kernel import MOST
from footfall.robot.proof.ground_tables import MOST_CELLS, GroundTables, ground_tables, lay_surface
from footfall.robot.proof.leg_clearance_kernel import (
    NO_GROUND,
    RAISED_GROUND,
    TRUE_GROUND,
    LegTables,
    legs_are_clear,
)
from footfall.robot.proof.shells import CENTER, DISC, HALF, REACH, shells

MODES = {"none": NO_GROUND, "true": TRUE_GROUND, "raised": RAISED_GROUND}
"""Ground modes of CollisionScene and of the compiled check."""

SLACK = 1e-4
"""Added to every required distance [m]."""

_SAME_TABLE = 0.02
"""Balls share a table of the ground where their radii differ by no more than this share."""

_FARTHER = 0.05
"""How far beyond what is required a drum's distance is looked for [m]."""

_COVERED = (*PARTS, TOUCHING_WHEEL)


def clearance_ground(
    robot: Robot,
    heights: ArrayLike,
    geometry: GridGeometry,
    clearance: float = 0.0,
    around: ArrayLike | None = None,
    within: float = np.inf,
    most_cells: int = MOST_CELLS,
) -> GroundTables:
    """The ground as LegClearance needs it: made once for a terrain, it serves every leg and stance.

    Args:
        robot: the rover.
        heights: (rows, cols) [m], NaN where unknown.
        geometry: the grid.
        clearance: the largest that a LegClearance will use it with [m].
        around: (x, y) of the part that is needed [m], where the whole would be too much; None: the whole.
        within: radius of that part [m]: one leg needs its hip's x, y and :func:`leg_reach`.
        most_cells: of all tables.

    Returns:
        Tables for the balls of every part.

    Raises:
        InvalidInput: heights and geometry don't fit together, or the ground is too large.
    """
    require_distances(clearance=clearance)
    radii = np.concatenate(_required_radii(robot.description, clearance))
    return ground_tables(heights, geometry, radius_classes(radii), around, within, most_cells)


def radius_classes(radii: Array, same: float = _SAME_TABLE) -> Array:
    """The fewest of some radii (k,) such that each has one that is no smaller, and larger by at most a share."""
    left, classes = np.unique(radii), []
    while len(left):
        classes.append(left[-1])
        left = left[left < (1 - same) * left[-1]]
    return np.array(classes)


def leg_covers(description: RobotDescription) -> dict[str, BallTree]:
    """The covers of the leg's parts and of the touching wheel, by part."""
    return _covers(_ByDigest(description))


def link_shells(description: RobotDescription) -> tuple[Array, Array]:
    """Shells of the leg's parts in order, then of the chassis and the payload; see shells.py."""
    return _shells(_ByDigest(description))


def leg_reach(robot: Robot) -> float:
    """How far from its hip-yaw joint the middle of any ball of a leg may get [m]."""
    reaches, cover = robot.description.legs[0].reaches, _covers(_ByDigest(robot.description))
    sizes = [np.linalg.norm(cover[part].centers, axis=1).max() for part in _COVERED]
    return float((np.append(reaches, reaches[-1]) + sizes).max())


class LegClearance:
    """One leg moves; chassis, payload, the other legs and the ground are frozen.

    posture: (legs × 6,) [rad], used for the frozen legs. T_site_base: (4, 4). ground: of :func:`clearance_ground`,
    or None. clearance: added to every δ [m]. raise_terrain: for the ground mode "raised" [m]. drum: whether the wheel's
    own shape is asked about where its balls leave it unsure.
    ``tables`` is what the compiled :func:`~footfall.robot.proof.leg_clearance_kernel.leg_is_clear` takes.
    """

    def __init__(
        self,
        robot: Robot,
        posture: ArrayLike,
        leg: int,
        T_site_base: ArrayLike,
        ground: GroundTables | None = None,
        clearance: float = 0.0,
        raise_terrain: float = 0.0,
        drum: bool = False,
    ) -> None:
        require_distances(clearance=clearance, raise_terrain=raise_terrain)
        q, self.leg = robot.require_posture(posture), robot.require_leg(leg)
        T_site_base = require_transform(T_site_base, "T_site_base")
        description = robot.description
        shell_table, points = _shells(_ByDigest(description))
        poses, shell_of, required, groups = _frozen(robot, q, self.leg, T_site_base, clearance)
        middles = (poses[:, :, :3] @ shell_table[shell_of, CENTER : CENTER + 3, None])[..., 0] + poses[:, :, 3]
        reach = shell_table[shell_of, REACH]
        T_site_hip = T_site_base @ description.legs[self.leg].T_base_hip
        if ground is not None:
            _require_region(ground, T_site_hip, leg_reach(robot))
        balls, trees = _balls(description, ground, clearance)
        self._has_ground = ground is not None
        self.tables = LegTables(
            T_site_hip=T_site_hip[:3].copy(),
            lengths=leg_lengths(description.legs[self.leg]),
            shells=shell_table,
            points=points,
            own=_own_pairs(description, clearance),
            frozen_poses=poses,
            frozen=np.column_stack([middles, reach, shell_of.astype(float)]),
            required=required,
            groups=np.array([_group(first, last, middles, reach, required) for first, last in groups]),
            balls=balls,
            trees=trees,
            lift=np.array([0.0, raise_terrain]),
            drums=wheel_drums(description, ground, clearance)
            if drum and ground is not None
            else np.zeros((2, MOST + 1)),
            reach=_reaches(description, shell_table),
            radii=ground.radii if ground is not None else np.zeros(0),
            ground=ground.cells if ground is not None else np.zeros(0),
            ground_layout=ground.layout if ground is not None else np.zeros((1, 11)),
        )

    def certified(self, qs: ArrayLike, terrain: str = "raised") -> NDArray[np.bool_]:
        """Which joint vectors (n, 6) [rad] are proven to be free, (n,); terrain: "none", "true" or "raised"."""
        rows = np.array(qs, float, order="C")  # a copy: compiled code takes read-only arrays for another kind
        if rows.ndim != 2 or rows.shape[1] != 6:
            raise InvalidInput("legs need n × 6 joint angles [rad]", shape=list(rows.shape))
        if terrain not in MODES:
            raise InvalidInput(f"terrain is one of {', '.join(MODES)}", terrain=terrain)
        return legs_are_clear(rows, self.tables, MODES[terrain] if self._has_ground else NO_GROUND)


def _frozen(
    robot: Robot, q: Array, leg: int, T_site_base: Array, clearance: float
) -> tuple[Array, NDArray[np.int64], Array, list[tuple[int, int]]]:
    """Poses (f, 3, 4), shells (f,), required distances (7, f) and groups of what does not move."""
    deltas = robot.description.clearances
    poses, shell_of = [T_site_base], [len(PARTS)]
    required = [[deltas.chassis.get(part) for part in PARTS]]
    groups = [(0, 1)]
    if robot.description.payload is not None:
        poses.append(T_site_base)
        shell_of.append(len(PARTS) + 1)
        required.append([deltas.payload] * len(PARTS))
        groups.append((1, 2))
    for other in robot.legs:
        if other != leg:
            Ts_base_link = leg_link_poses(robot, q[6 * other : 6 * other + 6], other)
            groups.append((len(poses), len(poses) + len(PARTS)))
            poses += [T_site_base @ Ts_base_link[link_name(other, part)] for part in PARTS]
            shell_of += range(len(PARTS))
            required += [[deltas.other_leg] * len(PARTS)] * len(PARTS)
    distances = [[-1.0 if delta is None else delta + clearance + SLACK for delta in row] for row in required]
    return np.array(poses)[:, :3].copy(), np.array(shell_of), np.array(distances).T.copy(), groups


def _group(first: int, last: int, middles: Array, reach: Array, required: Array) -> tuple[float, ...]:
    middle = middles[first:last].mean(axis=0)
    radius = float((np.linalg.norm(middles[first:last] - middle, axis=1) + reach[first:last]).max())
    return float(first), float(last), *middle, radius + float(required[:, first:last].max())


def _own_pairs(description: RobotDescription, clearance: float) -> Array:
    pairs = [
        (PARTS.index(pair.part_a), PARTS.index(pair.part_b), pair.distance + clearance + SLACK)
        for pair in description.clearances.own_leg
    ]
    return np.array(pairs, float).reshape(-1, 3)


def _balls(
    description: RobotDescription, ground: GroundTables | None, clearance: float
) -> tuple[Array, NDArray[np.int64]]:
    """Rows of ``LegTables.balls`` and the trees of both ground modes."""
    trees = np.zeros((2, len(PARTS), 2), np.int64)
    if ground is None:
        return np.zeros((0, 5)), trees
    rows, start = [], 0
    for part, radii in zip(_COVERED, _required_radii(description, clearance), strict=True):
        tree = _covers(_ByDigest(description))[part]
        if radii.max() > ground.radii[-1]:
            raise InvalidInput("the ground was made for a smaller clearance", clearance=clearance)
        rows.append(np.column_stack([tree.centers, np.searchsorted(ground.radii, radii), tree.skip + start]))
        end = start + len(radii)
        if part == TOUCHING_WHEEL:
            trees[TRUE_GROUND, -1] = start, end
        else:
            trees[:, PARTS.index(part)] = start, end
        start = end
    return np.concatenate(rows).astype(float), trees


def wheel_drums(description: RobotDescription, ground: GroundTables, clearance: float) -> Array:
    """Rows of ``LegTables.drums``; the ground's surface is laid for them.

    Args:
        description: of the rover.
        ground: tables that the wheel is compared with.
        clearance: that the leg is to keep [m].

    Returns:
        The rows; zeros where the wheel is no drum, or larger than what the ground was cut out for.
    """
    meshes = robot_meshes(description)
    deltas = {TRUE_GROUND: 0.0, RAISED_GROUND: description.clearances.terrain["wheel"] + clearance}
    drums = np.zeros((2, MOST + 1))
    lay_surface(ground)
    for mode, name in ((TRUE_GROUND, TOUCHING_WHEEL), (RAISED_GROUND, "wheel")):
        (shell,), points = shells([meshes[name]])
        required = deltas[mode] + SLACK
        most = min(_FARTHER, ground.radii[-1] - np.hypot(shell[DISC], shell[HALF + 1]) - required)
        if shell[DISC] > 0 and not points.any() and most >= 0:
            drums[mode] = *shell[CENTER : CENTER + 3], shell[DISC], shell[HALF + 1], required, most
    return drums


def _reaches(description: RobotDescription, shell_table: Array) -> Array:
    """Of each part: how far its surface and the middles of the balls that cover it get from its shell's middle [m]."""
    cover = _covers(_ByDigest(description))
    covered = [[part] if part != "wheel" else [part, TOUCHING_WHEEL] for part in PARTS]
    middles = shell_table[: len(PARTS), None, CENTER : CENTER + 3]
    return np.array(
        [
            max(reach, *(float(np.linalg.norm(cover[name].centers - at, axis=1).max()) for name in names))
            for names, at, reach in zip(covered, middles, shell_table[:, REACH], strict=False)
        ]
    )


def _required_radii(description: RobotDescription, clearance: float) -> list[Array]:
    """ρ + δ of the balls of each covered part [m]."""
    deltas = {part: delta + clearance for part, delta in description.clearances.terrain.items()}
    deltas[TOUCHING_WHEEL] = 0.0
    return [_covers(_ByDigest(description))[part].radii + deltas[part] + SLACK for part in _COVERED]


def _require_region(ground: GroundTables, T_site_hip: Array, reach: float) -> None:
    x, y, radius = ground.region
    if np.hypot(T_site_hip[0, 3] - x, T_site_hip[1, 3] - y) + reach > radius + SLACK:
        raise InvalidInput(
            "the ground was cut out around another place than this leg's",
            around=[x, y],
            within=radius,
            hip=T_site_hip[:2, 3].tolist(),
            reach=reach,
        )


class _ByDigest:
    """A description as the key of a cache: equal content is equal, in whatever object it came."""

    def __init__(self, description: RobotDescription) -> None:
        self.description = description

    def __hash__(self) -> int:
        return hash(self.description.digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByDigest) and self.description.digest == other.description.digest


@lru_cache(maxsize=8)
def _covers(key: _ByDigest) -> dict[str, BallTree]:
    meshes = robot_meshes(key.description)
    return {part: ball_tree(meshes[part]) for part in _COVERED}


@lru_cache(maxsize=8)
def _shells(key: _ByDigest) -> tuple[Array, Array]:
    """Shells of the leg's parts in order, then of the chassis and the payload."""
    meshes = robot_meshes(key.description)
    return shells([meshes[name] for name in (*PARTS, "base", PAYLOAD) if name in meshes])
