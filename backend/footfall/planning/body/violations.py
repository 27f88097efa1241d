"""How far many chassis poses at once fall short of what a step needs; closed-form kinematics only, no collisions.

A shift is good for a step of one leg when every standing leg keeps its wheel where it is, the leg can be raised above
its place and stand upright on the footfall and above it, the other feet carry the rover meanwhile, and the chassis
clears the ground. Each demand gives a violation: 0 where it is met with something to spare, else how far it is
missed, in metres or radians. What is found this way is checked by exact means afterwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.support import margins
from footfall.core.arrays import Array
from footfall.core.frames import inverse, rotation
from footfall.core.mesh import Mesh
from footfall.planning.body.body_move import StandingRover
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.follow import reaches_back, unwrapped
from footfall.planning.body.reserve import required
from footfall.planning.scene.ground import Contact
from footfall.planning.scene.lift import branch_of
from footfall.planning.scene.solids import part_poses
from footfall.planning.scene.unreached import shortfalls
from footfall.robot.description import link_name
from footfall.robot.ik import leg_azimuth, solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import center_of_mass, wheel_pose
from footfall.robot.leg_branches import bend_of, branch_number, wrist_of
from footfall.robot.reserve import joint_reserves, reach_reserves
from footfall.terrain.dem import Dem

JOINT_SPARE = 0.03
"""Distance to joint limits that is asked for here, so that the exact checks can do without luck [rad]."""
REACH_SPARE = 0.01
"""The same for a leg stretched straight or folded [m]."""
MARGIN_SPARE = 0.02
"""The same for the margin of the centre of mass [m]."""
GROUND_SPARE = 0.01
"""The same for the chassis over the ground [m]."""
PASSING, NOT_PASSING = 0.001, 0.006
"""A locked wheel passes its straight wrist where foot and shank come so near to one line [rad, about]; between the two
it is uncertain, and a violation."""
WAY = (1 / 3, 2 / 3, 1.0)
"""Fractions of the way at which the joints of the standing legs are looked at."""
PEAK = 0.2
"""Of every square of ground of this size the highest cell is looked at [m]."""
FOLDING = ("hip_pitch", "knee_pitch")
"""Parts that come near the chassis when a leg folds under it."""
FOLD_SPARE = 0.01
"""The same for the leg beside the chassis [m]."""
NEARLY = 0.1
"""Where the other violations come to less than this, the leg beside the chassis is looked at."""
UNREACHED = 1.0
"""Added for a wheel that is out of reach, so that joint limits never look worse."""


@dataclass(frozen=True)
class WheelPlace:
    """Where one leg's wheel has to be: T_site_wheel. free: its heading is, so the last joint does not count.

    label: for a person.
    """

    leg: int
    T_site_wheel: Array
    label: str
    free: bool = False


class StepViolations:
    """Those of one request; ``names`` says what each column is."""

    def __init__(self, stance: StandingRover, leg: int, contact: Contact, settings: FindShiftSettings) -> None:
        robot, state = stance.robot, stance.state
        self.stance, self.leg, self.settings = stance, leg, settings
        self._posture, self._T_site_base = np.asarray(state.posture), np.asarray(state.T_site_base)
        self._own_com = center_of_mass(robot, self._posture)
        self._reserves = {i: _reserves(stance, i, settings) for i in stance.standing}
        self._branches = [branch_of(robot, i, state.leg(i)) for i in robot.legs]
        now = [self._T_site_base @ wheel_pose(robot, self._posture, i) for i in robot.legs]
        up = np.zeros((4, 4))
        up[2, 3] = settings.lift
        self._locked = [WheelPlace(i, now[i], f"leg {i} keeping its wheel where it stands") for i in stance.standing]
        heading = leg_azimuth(robot, leg, self._T_site_base)
        on_target = wheel_pose_for_contact(robot, contact.point, contact.normal, heading, np.eye(4))
        # a leg that is in the air is carried along: it has no place to be raised above
        raised = WheelPlace(leg, now[leg] + up, f"leg {leg} raised above its place")
        self._steps = [
            *([raised] if leg in stance.standing else []),
            WheelPlace(leg, on_target + up, f"leg {leg} above the footfall", free=True),
            WheelPlace(leg, on_target, f"leg {leg} on the footfall", free=True),
        ]
        others = [i for i, foot in enumerate(stance.standing) if foot != leg]
        self._feet = stance.feet.points[others]
        chassis = robot.description.meshes["base"]
        radius = float(np.linalg.norm(chassis.vertices[:, :2], axis=1).max()) + settings.most_shift + PEAK
        self._peaks = _peaks(stance.body.ground.dem, self._T_site_base[:2, 3], radius)
        self._lowest = float(chassis.vertices[:, 2].min()), float(np.linalg.norm(chassis.vertices, axis=1).max())
        self._planes = _planes(chassis)
        self._folding = {part: _outline(robot.description.meshes[link_name(leg, part)]) for part in FOLDING}
        self.names = (
            *(place.label for place in (*self._locked, *self._steps)),
            *(f"the margin with {place.label}" for place in self._steps),
            f"the chassis beside leg {leg} on the footfall",
            "the chassis over the ground",
        )

    def poses(self, shifts: Array) -> Array:
        """T_site_base (n, 4, 4) after shifts (n, 6) as of BodyShift."""
        Ts = np.tile(self._T_site_base, (len(shifts), 1, 1))
        roll, pitch, yaw = shifts[:, 3:].T
        Ts[:, :3, :3] = Ts[:, :3, :3] @ rotation("z", yaw) @ rotation("y", pitch) @ rotation("x", roll)
        Ts[:, :3, 3] += shifts[:, :3]
        return Ts

    def of(self, shifts: Array) -> Array:
        """(n, names) of shifts (n, 6), each 0 or more."""
        Ts_site_base = self.poses(shifts)
        on_the_way = [inverse(self.poses(fraction * shifts)) for fraction in WAY[:-1]]
        Ts_base_site = inverse(Ts_site_base)
        out = np.zeros((len(shifts), len(self.names)))
        moment = np.tile(self._own_com, (len(shifts), 1))
        for column, place in enumerate(self._locked):
            q, out[:, column] = self._kept(place, [*on_the_way, Ts_base_site])
            if place.leg != self.leg:
                moment += self._change(place.leg, q)
        first = len(self._locked)
        q = np.empty((0, 6))
        for i, place in enumerate(self._steps):
            q, out[:, first + i] = self._reached(place, Ts_base_site)
            com = moment + self._change(self.leg, q)
            out[:, first + len(self._steps) + i] = self._unbalanced(Ts_site_base, com)
        out[:, -1] = self._low(Ts_site_base)
        # q is the last place's, the footfall; dearer than the rest, so only where the rest is nearly met
        near = np.flatnonzero(out.sum(axis=1) < NEARLY)
        out[near, -2] = self._folded(q[near])
        return out

    def _reached(self, place: WheelPlace, Ts_base_site: Array) -> tuple[Array, Array]:
        """The leg's angles (n, 6), NaN where out of reach, and the violation (n,)."""
        near = self._posture[6 * place.leg : 6 * place.leg + 6]
        both, stretch = self._both_wrists(place, Ts_base_site, REACH_SPARE)
        both = unwrapped(both, near)
        counted = 5 if place.free else 6
        away = np.abs(both[:, :, :counted] - near[:counted]).max(axis=2)
        q = both[np.arange(len(both)), np.argmin(np.where(np.isnan(away), np.inf, away), axis=1)]
        return q, stretch + self._outside(place.leg, q[:, :counted], JOINT_SPARE)

    def _kept(self, place: WheelPlace, Ts_base_site: Sequence[Array]) -> tuple[Array, Array]:
        """As :meth:`_reached`, for a locked wheel that is followed along the way, given by T_base_site (n, 4, 4).

        The wrist is straight where the foot's direction seen from the shank, (sin a · sin b, cos a · sin b) of knee
        roll a and ankle pitch b, is zero. There the other wrist solution takes over; where the way passes beside, the
        knee roll turns instead.
        """
        count = len(Ts_base_site[0])
        rows = np.arange(count)
        last = np.tile(self._posture[6 * place.leg : 6 * place.leg + 6], (count, 1))
        foot = _foot_direction(last)
        wrist = np.full(count, wrist_of(self._branches[place.leg]))
        short = np.zeros(count)
        for poses in Ts_base_site:
            ends = poses is Ts_base_site[-1]
            reach_spare, joint_spare = self._reserves[place.leg] if ends else (REACH_SPARE, JOINT_SPARE)
            both, stretch = self._both_wrists(place, poses, reach_spare)
            next_foot = _foot_direction(both[:, 0])
            change = next_foot - foot
            length = np.square(change).sum(axis=1)
            along = np.clip(-np.sum(foot * change, axis=1) / np.maximum(length, 1e-12), 0.0, 1.0)
            beside = np.linalg.norm(foot + along[:, None] * change, axis=1)
            back = np.sum(foot * next_foot, axis=1) < 0
            wrist = np.where(back & (beside <= PASSING), 1 - wrist, wrist)
            q = unwrapped(both[rows, wrist], last)
            unsure = np.where(back & (beside > PASSING), np.maximum(NOT_PASSING - beside, 0.0), 0.0)
            short = np.maximum(short, stretch + self._outside(place.leg, q, joint_spare) + unsure)
            last, foot = q, next_foot
        return last, short

    def _both_wrists(self, place: WheelPlace, Ts_base_site: Array, spare: float) -> tuple[Array, Array]:
        """Angles (n, 2, 6) of both wrists, NaN out of reach; how much too far the wheel is, with a spare [m], (n,)."""
        robot, leg = self.stance.robot, place.leg
        Ts_base_wheel = Ts_base_site @ place.T_site_wheel
        pair = branch_number(bend_of(self._branches[leg]), 0)
        back = reaches_back(robot, leg, self._posture[6 * leg : 6 * leg + 6])
        stretch = shortfalls(robot, leg, Ts_base_wheel, back)
        return solve_leg(robot, leg, Ts_base_wheel).q[:, pair : pair + 2], np.maximum(stretch + spare, 0.0)

    def _outside(self, leg: int, angles: Array, spare: float | Array) -> Array:
        """How far the leg's first joints (n, k) are outside the limits less a spare [rad]; UNREACHED where NaN."""
        own = slice(6 * leg, 6 * leg + angles.shape[1])
        low, high = self.stance.robot.lower[own] + spare, self.stance.robot.upper[own] - spare
        outside = np.maximum(np.maximum(low - angles, angles - high), 0.0).sum(axis=1)
        return np.where(np.isnan(outside), UNREACHED, outside)

    def _change(self, leg: int, q: Array) -> Array:
        """Change of the centre of mass (n, 3) in base by one leg's angles (n, 6); none where they are NaN."""
        changed = centers_of_mass(self.stance.robot, self._posture, leg, q) - self._own_com
        return np.nan_to_num(changed, nan=0.0)

    def _unbalanced(self, Ts_site_base: Array, coms: Array) -> Array:
        coms_xy = np.einsum("nij,nj->ni", Ts_site_base[:, :2, :3], coms) + Ts_site_base[:, :2, 3]
        spare = margins(self._feet, coms_xy, self.settings.conservative)
        return np.maximum(self.settings.least_margin + MARGIN_SPARE - spare, 0.0)

    def _folded(self, q: Array) -> Array:
        """How far the leg that steps is too near to the chassis, (n,) [m], for its angles (n, 6); 0 where NaN.

        By points on the links and the planes of the convex chassis: beside an edge it is nearer than it seems.
        """
        normals, offsets = self._planes
        poses = part_poses(self.stance.robot, self.leg, q)
        short = np.zeros(len(q))
        for part, outline in self._folding.items():
            T, delta = poses[part], self.stance.robot.description.clearances.chassis.get(part, 0.0)
            points = outline @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
            away = (points @ normals.T - offsets).max(axis=2).min(axis=1)
            short = np.maximum(short, delta + self.stance.body.clearance + FOLD_SPARE - np.nan_to_num(away, nan=np.inf))
        return short

    def _low(self, Ts_site_base: Array) -> Array:
        """How far the chassis is too near to the peaks of the ground, (n,) [m]; from below, by its planes."""
        body, (normals, offsets) = self.stance.body, self._planes
        wanted = self.stance.robot.description.clearances.chassis_terrain + body.clearance + GROUND_SPARE
        short = np.zeros(len(Ts_site_base))
        # no part is lower than the underside of the chassis turned about its origin
        tilt = np.sqrt(np.maximum(1.0 - Ts_site_base[:, 2, 2] ** 2, 0.0))
        lowest = Ts_site_base[:, 2, 3] + self._lowest[0] - tilt * self._lowest[1]
        near = np.flatnonzero(lowest < self._peaks[:, 2].max() + wanted)
        if len(near):
            T = inverse(Ts_site_base[near])
            points = self._peaks @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
            away = (points @ normals.T - offsets).max(axis=2).min(axis=1)
            short[near] = np.maximum(wanted - away, 0.0)
        return short


def _reserves(stance: StandingRover, leg: int, settings: FindShiftSettings) -> tuple[float, float | Array]:
    """What one standing leg is asked to have left where the chassis ends: of reach [m], of each joint (6,) [rad]."""
    now, own = stance.state.posture, slice(6 * leg, 6 * leg + 6)
    reach = required(reach_reserves(stance.robot, now)[leg], settings.reach_reserve)
    joints = required(joint_reserves(stance.robot, now)[own], settings.joint_reserve)
    return max(REACH_SPARE, float(reach)), np.maximum(JOINT_SPARE, joints)


def _peaks(dem: Dem, center_xy: Array, radius: float) -> Array:
    """The highest cell of every PEAK × PEAK square within about a radius of a place, (n, 3) [m]."""
    points = np.dstack([dem.geometry.centers(), dem.heights]).reshape(-1, 3).astype(np.float64)
    points = points[np.linalg.norm(points[:, :2] - center_xy, axis=1) <= radius]
    squares = np.floor(points[:, :2] / PEAK)
    order = np.lexsort([-points[:, 2], squares[:, 1], squares[:, 0]])
    _, first = np.unique(squares[order], axis=0, return_index=True)
    return points[order[first]]


def _foot_direction(q: Array) -> Array:
    """(n, 2), of leg angles (n, 6): see :meth:`StepViolations._kept`. The same for both wrists."""
    return np.sin(q[:, 4, None]) * np.stack([np.sin(q[:, 3]), np.cos(q[:, 3])], axis=1)


def _outline(mesh: Mesh) -> Array:
    """Corners of a mesh and the middles of its edges, (n, 3)."""
    edges = np.unique(np.sort(np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]]]), axis=1), axis=0)
    return np.concatenate([mesh.vertices, mesh.vertices[edges].mean(axis=1)])


def _planes(mesh: Mesh) -> tuple[Array, Array]:
    """Outward unit normals (m, 3) and offsets (m,) [m] of a convex mesh's faces, each once."""
    found = np.unique(np.round(ConvexHull(mesh.vertices).equations, 9), axis=0)
    return found[:, :3], -found[:, 3]


def largest(names: Sequence[str], violations: Array) -> str:
    """The largest violation of one shift, (names,), in words."""
    worst = int(np.argmax(violations))
    size = float(violations[worst])
    if size >= UNREACHED:
        return f"{names[worst]}: {size - UNREACHED:z.3f} m out of reach"
    return f"{names[worst]}: {size:z.3f} short (m or rad)"
