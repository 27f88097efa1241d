"""What holds the rover: support polygons by hulls, friction and torques by linear programs.

Over one stretch the same feet stand, so the friction margin is a concave function of where the centre of mass is, seen
from above (the value of a linear program, of its right-hand side): over all samples, and all between them, it is no
less than at the corners of a polygon around them. Torques also depend on the posture.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, QhullError

from footfall.balance.balance_settings import GRAVITY
from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.core.errors import FootFallError
from footfall.planning.answers import Check
from footfall.planning.walk.problem import CheckedMotion, Tethered, WalkSettings
from footfall.planning.walk.recheck.feet import Worst
from footfall.planning.walk.recheck.stretches import MotionStretch
from footfall.robot.model import Robot

SIDES = 16
"""Of the friction pyramids, inside their cones."""
SOLVED, INFEASIBLE = 0, 2
"""Status of scipy's linear programs."""
CELL = 0.002
"""Of the lattice on which polygons around centres of mass have their corners [m]."""
PULLED = 0.02
"""How far the tether's pull may be from what is told [weights], as that was found with other pyramids."""
NOT_HELD = -1.0
"""Margin where no forces at all balance the weight: all of it is lacking."""


class HoldingCheck:
    """Gathers the least margins of support, friction and torque over all stretches.

    Linear programs are solved only where they may give less than was found before.
    """

    def __init__(self, robot: Robot, plan: CheckedMotion, settings: WalkSettings, turn: float) -> None:
        self.robot, self.plan, self.settings, self.turn = robot, plan, settings, turn
        self.tethered = plan.tethered
        self.support, self.friction, self.torque = Worst(), Worst(), Worst()
        self._model = robot.model.copy()
        self._scratch = self._model.createData()

    def look(self, stretch: MotionStretch, pulse: Callable[[], None]) -> None:
        """Take a stretch into account."""
        stance, feet = self.plan.stances[stretch.move], stretch.standing
        contacts, normals = stance.contacts[feet], stance.normals[feet]
        seen = np.eye(3)[:, :2] if self.tethered is None else _across(self.tethered.up)
        spare = self._polygon_margins(contacts @ seen, stretch.coms_site @ seen) - self.settings.least_margin
        at = int(np.argmin(spare))
        self.support.take(float(spare[at]), stretch.where(at))
        faces = pyramids(normals, self.settings.friction)
        if self.tethered is None:
            self._look_at_friction(stretch, contacts, faces, pulse)
        forces = np.zeros(3 * len(feet) + (self.tethered is not None))
        for at in turned(stretch, self.turn):
            pulse()
            load = self._load(stretch, at, contacts)
            if self.tethered is not None:
                self._look_at_hanging(stretch, at, load, faces, self.tethered)
            if load.ratio(_shared(load, forces), faces) <= self.settings.most_torque - self.torque.spare:
                continue
            found = load.least(faces)
            if found is None:
                continue  # friction has failed there
            forces = found
            ratios = load.ratios(forces)
            joint = [*self.robot.joint_names, "tether"][int(np.argmax(ratios))]
            self.torque.take(self.settings.most_torque - float(ratios.max()), f"{joint}, {stretch.where(at)}")

    def checks(self) -> tuple[Check, ...]:
        """Of support, friction and torque; torque is not judged where no forces hold the rover."""
        torque = self.torque.check("torque", "of the limit")
        if not np.isfinite(torque.margin):
            torque = Check("torque", True, float("nan"), "of the limit", "no forces inside friction hold it anywhere")
        return self.support.check("support", "m"), self.friction.check("friction", "of the weight"), torque

    def _look_at_friction(
        self, stretch: MotionStretch, contacts: Array, faces: Array, pulse: Callable[[], None]
    ) -> None:
        coms = stretch.coms_site
        for corner in _corners_around(coms[:, :2]):
            pulse()
            margin = friction_margin(contacts, faces, np.append(corner, coms[0, 2]))
            if margin < self.friction.spare:
                nearest = int(np.argmin(np.square(coms[:, :2] - corner).sum(axis=1)))
                self.friction.take(margin, stretch.where(nearest))

    def _look_at_hanging(self, stretch: MotionStretch, at: int, load: "Load", faces: Array, tethered: Tethered) -> None:
        """Friction at a sample of a walk on a tether; at waypoints with the very pull that the walk says."""
        where = stretch.where(at)
        given = float(tethered.pulls[stretch.waypoints[at]]) / (self.robot.mass * GRAVITY)
        drum = float(load.effect[-1, -1])
        if stretch.fractions[at] == 1.0:
            found = load.least(faces, given)
            spare = NOT_HELD if found is None else self.settings.most_torque - float(load.ratios(found).max())
            if spare < 0:
                self.torque.take(spare, f"with the pull that is told, {where}")
        self.friction.take(load.friction(faces, 1.0 / drum), where)
        if self.settings.support == "required":
            for foot in range(len(faces)):
                margin = load.without(foot).friction(np.delete(faces, foot, axis=0), 1.0 / drum)
                self.friction.take(margin, f"without the foot of leg {stretch.standing[foot]}, {where}")

    def _polygon_margins(self, feet_xy: Array, coms_xy: Array) -> Array:
        """How far inside the polygon that the settings ask for centres of mass (n, 2) are, (n,) [m]."""
        if self.settings.support != "required":
            return _inside_hull(feet_xy, coms_xy)
        without_one = [_inside_hull(np.delete(feet_xy, foot, axis=0), coms_xy) for foot in range(len(feet_xy))]
        return np.min(without_one, axis=0)

    def _load(self, stretch: MotionStretch, at: int, contacts: Array) -> "Load":
        q, T, model, scratch = stretch.qs[at], stretch.Ts_site_base[at], self._model, self._scratch
        R, limits, weight = T[:3, :3], self.robot.torque_limits, self.robot.mass * GRAVITY
        model.gravity = pin.Motion(-GRAVITY * R[2], np.zeros(3))
        gravity = np.array(pin.computeGeneralizedGravity(model, scratch, q)) / limits
        pin.computeJointJacobians(model, scratch, q)
        J, points = np.array(scratch.J), (contacts - T[:3, 3]) @ R
        effect = np.zeros((len(q), 3 * len(contacts)))
        for foot, leg in enumerate(stretch.standing):
            own = slice(6 * leg, 6 * leg + 6)
            # the motion of the contact, thought fixed to the leg's last link
            moved = J[:3, own] - _crossed(points[foot]) @ J[3:, own]
            effect[own, 3 * foot : 3 * foot + 3] = -weight * (R @ moved).T / limits[own, None]
        load = Load(gravity, effect, *_balance(contacts, stretch.coms_site[at]))
        return load if self.tethered is None else self._on_tether(load, stretch, at, contacts, self.tethered.tether)

    def _on_tether(self, load: "Load", stretch: MotionStretch, at: int, contacts: Array, tether: Tether) -> "Load":
        """The load with the tether's pull as one more force, and its share of the drum's most as one more ratio."""
        T, com = stretch.Ts_site_base[at], stretch.coms_site[at]
        end = T[:3, :3] @ tether.attachment + T[:3, 3]
        toward = (tether.anchor - end) / np.linalg.norm(tether.anchor - end)
        size = float(np.abs(contacts - com).max())
        wrench = np.concatenate([toward, np.cross((end - com) / size, toward)])
        effect = np.zeros((len(load.gravity) + 1, load.effect.shape[1] + 1))
        effect[:-1, :-1] = load.effect
        effect[-1, -1] = self.robot.mass * GRAVITY / tether.most_force
        return Load(np.append(load.gravity, 0.0), effect, np.column_stack([load.A, wrench]), load.b)


@dataclass(frozen=True)
class Load:
    """What joints bear at one posture, as shares of their limits: gravity (n,) + effect (n, 3k) · forces, in weights.

    A (6, 3k), b (6,): forces are in equilibrium where A · forces = b. On a tether its pull is one more of the forces,
    and its drum one more joint.
    """

    gravity: Array
    effect: Array
    A: Array
    b: Array

    def ratios(self, forces: Array) -> Array:
        """What each joint bears (n,) at forces (3k,) [weights], the pull of a tether one more, as a share."""
        return np.abs(self.gravity + self.effect @ forces)

    def ratio(self, forces: Array, faces: Array) -> float:
        """Largest share for forces in equilibrium; inf where they are not inside friction.

        forces: as of :meth:`ratios`. faces: (k, sides, 3) inward normals of the feet's pyramids.
        """
        feet = 3 * len(faces)
        inside = np.einsum("ksj,kj->ks", faces, forces[:feet].reshape(-1, 3)).min() >= 0 and (forces[feet:] >= 0).all()
        return float(self.ratios(forces).max()) if inside else float("inf")

    def without(self, foot: int) -> "Load":
        """Without the force on one foot."""
        own = slice(3 * foot, 3 * foot + 3)
        return Load(self.gravity, np.delete(self.effect, own, axis=1), np.delete(self.A, own, axis=1), self.b)

    def friction(self, faces: Array, most: float) -> float:
        """:func:`friction_margin` with a pull of at most ``most`` [weights]."""
        inside = self._inside(faces)
        # what a pull could bear sideways is not asked
        spare = np.append(np.ones(faces.shape[0] * faces.shape[1]), 0.0)[: len(inside)]
        bounds = [(None, None)] * (self.A.shape[1] - 1) + [(0.0, most), (None, None)]
        found = linprog(
            np.append(np.zeros(self.A.shape[1]), -1.0),
            np.column_stack([-inside, spare]),
            np.zeros(len(inside)),
            np.column_stack([self.A, np.zeros(6)]),
            self.b,
            bounds,
            "highs",
        )
        return float(found.x[-1]) if found.status == SOLVED else NOT_HELD

    def _inside(self, faces: Array) -> Array:
        """Rows over all forces that are at least zero where they are inside friction, and a pull pulls."""
        blocks, pulls = _blocks(faces), self.A.shape[1] - 3 * len(faces)
        if not pulls:
            return blocks
        out = np.zeros((len(blocks) + pulls, self.A.shape[1]))
        out[: len(blocks), : blocks.shape[1]] = blocks
        out[len(blocks) :, blocks.shape[1] :] = np.eye(pulls)
        return out

    def least(self, faces: Array, pull: float | None = None) -> Array | None:
        """The forces inside friction, in equilibrium, whose largest share is least; None where there are none.

        As of :meth:`ratio`. pull: of the tether, where it is given, within PULLED [weights].
        """
        most, free = np.ones((len(self.gravity), 1)), self.A.shape[1]
        inside = self._inside(faces)
        bounds: list[tuple[float | None, float | None]] = [(None, None)] * (free + 1)
        if pull is not None:
            bounds[free - 1] = (max(pull - PULLED, 0.0), pull + PULLED)
        program = (
            np.append(np.zeros(free), 1.0),
            np.vstack(
                [
                    np.hstack([self.effect, -most]),
                    np.hstack([-self.effect, -most]),
                    np.column_stack([-inside, np.zeros(len(inside))]),
                ]
            ),
            np.concatenate([-self.gravity, self.gravity, np.zeros(len(inside))]),
            np.column_stack([self.A, np.zeros(6)]),
            self.b,
            bounds,
        )
        found = linprog(*program, "highs")
        if found.status not in (SOLVED, INFEASIBLE):
            # of a weight far outside of the feet the simplex method may end without an answer
            found = linprog(*program, "highs-ipm")
        if found.status not in (SOLVED, INFEASIBLE):
            raise FootFallError("the torque program was not solved", status=int(found.status))
        return found.x[:-1] if found.status == SOLVED else None


def _shared(load: Load, forces: Array) -> Array:
    """The forces in equilibrium that are nearest to some."""
    return forces + np.linalg.lstsq(load.A, load.b - load.A @ forces, rcond=None)[0]


def _inside_hull(feet_xy: Array, points: Array) -> Array:
    """How far points (n, 2) are inside the hull of some feet, (n,) [m]; −inf where the feet span nothing."""
    try:
        sides = ConvexHull(feet_xy).equations
    except (QhullError, ValueError):
        return np.full(len(points), -np.inf)
    return -(points @ sides[:, :2].T + sides[:, 2]).max(axis=1)


def _corners_around(points: Array) -> Array:
    """Corners of a polygon around points (n, 2), the hull of all cells of a lattice that they are in, (k, 2) [m]."""
    cells = np.unique(np.floor(points / CELL), axis=0)
    corners = (cells[:, None] + np.array([(0, 0), (0, 1), (1, 0), (1, 1)])).reshape(-1, 2)
    return CELL * corners[ConvexHull(corners).vertices]


def _across(up: Array) -> Array:
    """Two unit vectors across a unit vector and each other, (3, 2)."""
    u = np.cross(up, np.eye(3)[int(np.abs(up).argmin())])
    u /= np.linalg.norm(u)
    return np.asarray(np.column_stack([u, np.cross(up, u)]), float)


def turned(stretch: MotionStretch, turn: float) -> list[int]:
    """Both ends, every waypoint, and so many samples that no joint turns by more between two of them."""
    chosen, last = [0], stretch.qs[0]
    for at in range(1, len(stretch.qs)):
        here = at + 1 == len(stretch.qs) or stretch.fractions[at] == 1.0
        if here or np.abs(stretch.qs[at + 1] - last).max() > turn:
            chosen.append(at)
            last = stretch.qs[at]
    return chosen


def pyramids(normals: Array, friction: float) -> Array:
    """Inward normals (k, sides, 3) of pyramids inside the friction cones: forces are inside where they are ≥ 0."""
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    u = np.cross(unit, np.eye(3)[np.abs(unit).argmin(axis=1)])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(unit, u)
    angles = 2 * np.pi / SIDES * np.arange(SIDES)
    tangents = np.cos(angles)[None, :, None] * u[:, None] + np.sin(angles)[None, :, None] * v[:, None]
    return friction * np.cos(np.pi / SIDES) * unit[:, None] - tangents


def _blocks(faces: Array) -> Array:
    """The faces of all feet as one matrix over all forces, (k · sides, 3k)."""
    k, sides, _ = faces.shape
    out = np.zeros((k * sides, 3 * k))
    for foot in range(k):
        out[sides * foot : sides * (foot + 1), 3 * foot : 3 * foot + 3] = faces[foot]
    return out


def _balance(contacts: Array, com: Array) -> tuple[Array, Array]:
    """Force and moment of contact forces, in weights, (6, 3k), and what they must be, (6,)."""
    arms = contacts - com
    size = float(np.abs(arms).max())
    A = np.vstack([np.tile(np.eye(3), len(arms)), np.hstack([_crossed(arm) for arm in arms / size])])
    return A, np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def _crossed(arm: Array) -> Array:
    """The matrix (3, 3) that takes a vector to arm × vector."""
    x, y, z = arm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def friction_margin(contacts: Array, faces: Array, com: Array) -> float:
    """What every foot could bear sideways in addition.

    Args:
        contacts: (k, 3) in site [m].
        faces: inward normals of the feet's pyramids, (k, sides, 3).
        com: centre of mass, (3,) in site [m].

    Returns:
        A share of the weight; negative where every foot must bear it, and can't.
    """
    A, b = _balance(contacts, com)
    k = len(contacts)
    found = linprog(
        np.append(np.zeros(3 * k), -1.0),
        np.column_stack([-_blocks(faces), np.ones(faces.shape[0] * faces.shape[1])]),
        np.zeros(faces.shape[0] * faces.shape[1]),
        np.column_stack([A, np.zeros(6)]),
        b,
        (None, None),
        "highs",
    )
    return float(found.x[-1]) if found.status == SOLVED else NOT_HELD
