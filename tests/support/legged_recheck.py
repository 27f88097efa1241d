"""A legged robot's plan judged by other means than it was made with.

Kinematics, masses and collision shapes come from pin's own reader of the URDF, forces from a linear program (HiGHS),
the support polygon from shapely, distances to the ground from coal against a mesh of it. A foot that stands rolls: from
one waypoint to the next the point of it that touches stays where it is. Nothing but the plan, the terrain's heights and
the names of legs and soles is shared with the planner.
"""

from dataclasses import dataclass, field
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation, Slerp
from shapely.geometry import MultiPoint, Point

from footfall.balance.friction import FRICTION
from footfall.planning.legged.problem import LeggedPlan
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

GRAVITY = 9.81
ROLLS = 4
"""Parts of a foot's rolling from one waypoint to the next."""


@dataclass
class Found:
    """The worst of each kind: feet's drift and depth [m], least distances [m], least margin [m], largest share."""

    drift: float = 0.0
    depth: float = 0.0
    off_ground: float = 0.0
    beyond_limits: float = 0.0
    apart: float = np.inf
    over_ground: float = np.inf
    margin: float = np.inf
    effort: float = 0.0
    worst: dict[str, str] = field(default_factory=dict)


def faults(found: Found) -> list[str]:
    """What a walk may not do: feet that drift or are let down in the air or the ground, bodies that touch, a fall."""
    judged = (
        (found.drift > 2e-3, f"a foot that stands drifts {1e3 * found.drift:.1f} mm"),
        (found.depth > 2e-3, f"a foot goes {1e3 * found.depth:.1f} mm into the ground"),
        (found.off_ground > 2e-3, f"a foot is let down {1e3 * found.off_ground:.1f} mm off the ground"),
        (found.beyond_limits > 1e-9, f"a joint is {found.beyond_limits:.3g} beyond its limit"),
        (found.apart <= 0, f"bodies touch: {found.worst.get('apart')}"),
        (found.over_ground <= 0, f"a body meets the ground: {found.worst.get('over_ground')}"),
        (found.margin <= 0, f"the weight is {-1e3 * found.margin:.0f} mm outside the feet"),
        (found.effort > 1, f"efforts reach {found.effort:.2f} of a limit {found.worst.get('effort')}"),
    )
    return [text for wrong, text in judged if wrong]


def said(found: Found) -> str:
    """In words: what is wrong, or the least margins."""
    wrong = faults(found)
    if wrong:
        return "; ".join(wrong)
    return (
        f"holds: margin {1e3 * found.margin:.0f} mm, effort {found.effort:.0%}, "
        f"bodies {1e3 * found.apart:.0f} mm apart, feet drift {1e3 * found.drift:.1f} mm"
    )


class Recheck:
    """A robot as pin reads its URDF; folders: in which its packages lie."""

    def __init__(self, urdf: Path, robot: LeggedRobot, folders: list[Path]) -> None:
        self.robot = robot
        self.model = pin.buildModelFromUrdf(str(urdf))
        self.data = self.model.createData()
        self.middle = pin.neutral(self.model)
        for name, angle in robot.model.tree.neutral().items():
            at, wide = self._place(name)
            self.middle[at : at + wide] = (angle,) if wide == 1 else (np.cos(angle), np.sin(angle))
        self.places = [self._place(name) for name in robot.joint_names]
        packages = [str(folder) for folder in folders]
        self.shapes = pin.buildGeomFromUrdf(self.model, str(urdf), pin.GeometryType.COLLISION, package_dirs=packages)
        self.feet = [self.model.getFrameId(leg.foot) for leg in robot.model.legs]
        self.soles = np.array([leg.sole.center for leg in robot.model.legs])
        first = robot.model.tree.bodies()
        names = [self.model.frames[one.parentFrame].name for one in self.shapes.geometryObjects]
        joints = [one.parentJoint for one in self.shapes.geometryObjects]
        touching = {frozenset(robot.body_names[body] for body in pair) for pair in robot.touching}
        for a in range(len(names)):
            for b in range(a):
                joined = joints[a] == joints[b] or self.model.parents[joints[a]] == joints[b]
                joined = joined or self.model.parents[joints[b]] == joints[a]
                if not joined and frozenset((first[names[a]], first[names[b]])) not in touching:
                    self.shapes.addCollisionPair(pin.CollisionPair(a, b))
        for one in self.shapes.geometryObjects:
            one.geometry.computeLocalAABB()
        self.near_feet = {k for k, name in enumerate(names) if name in {leg.foot for leg in robot.model.legs}}
        self.shape_data = self.shapes.createData()

    def full(self, q: np.ndarray) -> np.ndarray:
        """The posture of pin's model: joints that are no leg's stay in the middle."""
        posture = self.middle.copy()
        for angle, (at, wide) in zip(q, self.places, strict=True):
            posture[at : at + wide] = (angle,) if wide == 1 else (np.cos(angle), np.sin(angle))
        return posture

    def _place(self, name: str) -> tuple[int, int]:
        """Where a joint's angle is in pin's posture, and how many numbers it is: two of a continuous joint."""
        joint = self.model.getJointId(name)
        return self.model.idx_qs[joint], self.model.joints[joint].nq

    def soles_at(self, q: np.ndarray, T_site_base: np.ndarray) -> np.ndarray:
        """Centres of the soles in site, (legs, 3)."""
        pin.framesForwardKinematics(self.model, self.data, self.full(q))
        in_base = [self.data.oMf[foot].act(sole) for foot, sole in zip(self.feet, self.soles, strict=True)]
        return np.array(in_base) @ T_site_base[:3, :3].T + T_site_base[:3, 3]

    def walk(self, dem: Dem, plan: LeggedPlan, every: int) -> Found:
        """Every waypoint by the weight's margin, and by kinematics, the middles between them too; every so many by
        forces and distances."""
        found, ground = Found(), _ground(dem)
        stand, contacts, normals = plan.start.soles.copy(), plan.start.contacts.copy(), plan.start.normals.copy()
        downs = _downs(plan)
        for k in range(len(plan.waypoints)):
            moving = int(plan.legs[k])
            standing = [leg for leg in self.robot.legs if leg != moving]
            before = stand.copy()
            if k and self.robot.radii.any() and not np.array_equal(plan.Ts_site_base[k - 1], plan.Ts_site_base[k]):
                self._roll(dem, plan, k, stand, contacts, normals, standing)
            self._kinematics(found, dem, plan.waypoints[k], plan.Ts_site_base[k], stand, standing, moving)
            self._weight(found, plan.waypoints[k], plan.Ts_site_base[k], contacts[standing])
            if k and moving == plan.legs[k - 1]:
                q = (plan.waypoints[k] + plan.waypoints[k - 1]) / 2
                T = _middle(plan.Ts_site_base[k - 1], plan.Ts_site_base[k])
                self._kinematics(found, dem, q, T, (before + stand) / 2, standing, moving)
            if k % every == 0:
                q, T = plan.waypoints[k], plan.Ts_site_base[k]
                self._distances(found, ground, q, T, k)
                self._forces(found, q, T, standing, contacts, normals, k)
            if k in downs:
                stand[moving] = self.soles_at(plan.waypoints[k], plan.Ts_site_base[k])[moving]
                contacts[moving], normals[moving] = _contact(dem, stand[moving], float(self.robot.radii[moving]))
                gap = float(np.linalg.norm(stand[moving] - contacts[moving])) - self.robot.radii[moving]
                found.off_ground = max(found.off_ground, abs(gap))
        found.off_ground = max(found.off_ground, float(np.abs(stand - plan.end.soles).max()))
        return found

    def _roll(self, dem, plan, k, stand, contacts, normals, standing):
        """Feet roll from the waypoint before to this one; where they stand, and on what, is kept up to date."""
        turns = []
        for at in (k - 1, k):
            pin.framesForwardKinematics(self.model, self.data, self.full(plan.waypoints[at]))
            turns.append([plan.Ts_site_base[at, :3, :3] @ self.data.oMf[foot].rotation for foot in self.feet])
        for leg in standing:
            turned = Rotation.from_matrix(turns[1][leg] @ turns[0][leg].T).as_rotvec()
            # turning about the point that touches, in small parts
            for _ in range(ROLLS):
                arm = stand[leg] - contacts[leg]
                going = Rotation.from_rotvec(turned / ROLLS).apply(arm) - arm
                stand[leg] += going
                contacts[leg] += going - (going @ normals[leg]) * normals[leg]
            contacts[leg], normals[leg] = _contact(dem, stand[leg], float(self.robot.radii[leg]))
            up = (stand[leg] - contacts[leg]) / np.linalg.norm(stand[leg] - contacts[leg])
            stand[leg] = contacts[leg] + self.robot.radii[leg] * up

    def _kinematics(self, found, dem, q, T, stand, standing, moving):
        soles = self.soles_at(q, T)
        found.drift = max(found.drift, float(np.linalg.norm(soles - stand, axis=1)[standing].max()))
        low, high = self.model.lowerPositionLimit, self.model.upperPositionLimit
        for angle, (at, wide) in zip(q, self.places, strict=True):
            if wide == 1:
                found.beyond_limits = max(found.beyond_limits, low[at] - angle, angle - high[at])
        if moving >= 0:
            contact, _ = _contact(dem, soles[moving], float(self.robot.radii[moving]))
            below = soles[moving][2] < float(height_at(dem, *soles[moving][:2]))
            away = float(np.linalg.norm(soles[moving] - contact)) * (-1 if below else 1)
            found.depth = max(found.depth, self.robot.radii[moving] - away)

    @property
    def mass(self) -> float:
        return float(sum(inertia.mass for inertia in self.model.inertias))

    def center_of_mass(self, posture: np.ndarray) -> np.ndarray:
        """Of all bodies one by one, in base, (3,)."""
        pin.forwardKinematics(self.model, self.data, posture)
        weighed = [one.mass * T.act(one.lever) for one, T in zip(self.model.inertias, self.data.oMi, strict=True)]
        return np.sum(weighed, axis=0) / self.mass

    def _distances(self, found, ground, q, T, k):
        pin.updateGeometryPlacements(self.model, self.data, self.shapes, self.shape_data, self.full(q))
        pin.computeDistances(self.shapes, self.shape_data)
        for pair, one in zip(self.shapes.collisionPairs, self.shape_data.distanceResults, strict=True):
            if one.min_distance < found.apart:
                found.apart = one.min_distance
                parts = (self.shapes.geometryObjects[i].name for i in (pair.first, pair.second))
                found.worst["apart"] = f"{' and '.join(parts)} at {k}"
        for number, shape in enumerate(self.shapes.geometryObjects):
            if number in self.near_feet:
                continue
            T_site_shape = T @ self.shape_data.oMg[number].homogeneous
            if T_site_shape[2, 3] - ground.highest > shape.geometry.aabb_radius + found.over_ground:
                continue
            where = coal.Transform3s(T_site_shape[:3, :3], T_site_shape[:3, 3])
            away = coal.distance(
                ground.mesh, coal.Transform3s(), shape.geometry, where, coal.DistanceRequest(), coal.DistanceResult()
            )
            if away < found.over_ground:
                found.over_ground, found.worst["over_ground"] = float(away), f"{shape.name} at {k}"

    def _weight(self, found, q, T, contacts):
        com = T[:3, :3] @ self.center_of_mass(self.full(q)) + T[:3, 3]
        polygon = MultiPoint(contacts[:, :2]).convex_hull
        spare = polygon.boundary.distance(Point(com[:2])) * (1 if polygon.contains(Point(com[:2])) else -1)
        found.margin = min(found.margin, spare)

    def _forces(self, found, q, T, standing, contacts, normals, k):
        share = self.least_share(q, T, standing, contacts[standing], normals[standing])
        if share > found.effort:
            found.effort, found.worst["effort"] = share, f"at {k}"

    def least_share(self, q, T, standing, contacts, normals, edges=None) -> float:
        """Least possible largest |effort| / limit, inf where no forces hold the robot: one linear program.

        edges: of the friction pyramids (k, sides, 3), where they are not to be those of this file.
        """
        posture, R = self.full(q), T[:3, :3]
        self.model.gravity = pin.Motion(-GRAVITY * R[2], np.zeros(3))
        own = pin.computeGeneralizedGravity(self.model, self.data, posture)
        com = R @ self.center_of_mass(posture) + T[:3, 3]
        mass = self.mass
        pin.computeJointJacobians(self.model, self.data, posture)
        pin.updateFramePlacements(self.model, self.data)
        columns, wrench = [], []
        pyramids = [_edges(normal) for normal in normals] if edges is None else edges
        for leg, point, pyramid in zip(standing, contacts, pyramids, strict=True):
            J = pin.getFrameJacobian(self.model, self.data, self.feet[leg], pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            arm = R.T @ (point - T[:3, 3]) - self.data.oMf[self.feet[leg]].translation
            J_point = J[:3] - pin.skew(arm) @ J[3:]
            for edge in pyramid:
                columns.append(-J_point.T @ (R.T @ edge))
                wrench.append(np.concatenate([edge, np.cross(point - com, edge)]))
        names = [self.model.idx_vs[self.model.getJointId(name)] for name in self.robot.joint_names]
        limits = self.robot.efforts
        kept = np.isfinite(limits)
        effect = np.array(columns).T[names][kept] / limits[kept, None]
        constant = own[names][kept] / limits[kept]
        weight = np.array([0.0, 0.0, mass * GRAVITY, 0.0, 0.0, 0.0])
        count = len(columns)
        answer = linprog(
            np.append(np.zeros(count), 1.0),
            A_ub=np.block([[effect, -np.ones((len(effect), 1))], [-effect, -np.ones((len(effect), 1))]]),
            b_ub=np.concatenate([-constant, constant]),
            A_eq=np.hstack([np.array(wrench).T, np.zeros((6, 1))]),
            b_eq=weight,
            bounds=[(0, None)] * count + [(0, None)],
            method="highs",
        )
        return float(answer.fun) if answer.status == 0 else np.inf


def _edges(normal: np.ndarray, sides: int = 16) -> np.ndarray:
    """Edges of a pyramid inside the friction cone, (sides, 3)."""
    n = normal / np.linalg.norm(normal)
    u = np.cross(n, (1.0, 0.0, 0.0) if abs(n[0]) < 0.9 else (0.0, 1.0, 0.0))
    u /= np.linalg.norm(u)
    angles = 2 * np.pi * np.arange(sides) / sides
    return n + FRICTION * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * np.cross(n, u))


def _downs(plan: LeggedPlan) -> set[int]:
    """Waypoints at which a foot has come down."""
    last = len(plan.legs) - 1
    return {k for k in range(len(plan.legs)) if plan.legs[k] >= 0 and (k == last or plan.legs[k + 1] != plan.legs[k])}


def _contact(dem: Dem, center: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """The ground's point nearest to a ball's centre, looked for on a fine lattice, and the ground's normal there."""
    size, best = max(1.5 * radius, 0.02), center
    for _ in range(3):
        steps = np.linspace(-size, size, 21)
        x, y = best[0] + steps[:, None], best[1] + steps
        points = np.stack(np.broadcast_arrays(x, y, height_at(dem, x, y)), axis=-1)
        best = points.reshape(-1, 3)[np.nanargmin(((points - center) ** 2).sum(axis=-1))]
        size /= 7
    reach = max(radius, 0.02, dem.geometry.resolution)
    sides = [
        height_at(dem, center[0] + dx, center[1] + dy) for dx, dy in ((reach, 0), (-reach, 0), (0, reach), (0, -reach))
    ]
    normal = np.array([sides[1] - sides[0], sides[3] - sides[2], 2 * reach])
    return best, normal / np.linalg.norm(normal)


def _middle(T_a: np.ndarray, T_b: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Slerp([0, 1], Rotation.from_matrix([T_a[:3, :3], T_b[:3, :3]]))(0.5).as_matrix()
    T[:3, 3] = (T_a[:3, 3] + T_b[:3, 3]) / 2
    return T


@dataclass
class _Ground:
    mesh: coal.BVHModelOBBRSS
    highest: float


def _ground(dem: Dem) -> _Ground:
    """The terrain as triangles for coal, each block cut from south-west to north-east."""
    grid = dem.geometry
    x, y = np.meshgrid(
        grid.x0 + grid.resolution * np.arange(grid.cols), grid.y0 + grid.resolution * np.arange(grid.rows)
    )
    vertices = np.stack([x, y, dem.heights], axis=-1).reshape(-1, 3).astype(float)
    at = np.arange(grid.rows * grid.cols).reshape(grid.rows, grid.cols)
    sw, se, nw, ne = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]))
    model = coal.BVHModelOBBRSS()
    model.beginModel(2 * len(sw), len(vertices))
    model.addVertices(vertices)
    model.addTriangles(np.concatenate([np.stack([sw, se, ne], axis=1), np.stack([sw, ne, nw], axis=1)]))
    model.endModel()
    return _Ground(model, float(dem.heights.max()))
