"""A legged robot that everything computes with: its legs as limbs, one pin model, bodies with their shapes.

Only the joints of legs move; whatever else has joints (an arm, a head) is held as its posture ``stand`` says, or in the
middle, and counts to what carries it.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput, InvalidRobot, NotFound
from footfall.core.frames import apply, inverse
from footfall.core.mesh import Mesh
from footfall.robot.description import CameraPairSpec
from footfall.robot.legged.able_to_walk import why_unable
from footfall.robot.legged.followers import coupling_of, limits_of
from footfall.robot.legged.groups import longest_leg
from footfall.robot.legged.legged_model import STAND, DescribedRobot, LegChain, LeggedModel, held_joints
from footfall.robot.legged.tree import TreeJoint, TreeLink
from footfall.robot.limb.by_structure import solver_of
from footfall.robot.limb.limb import limb_of

CLEARANCE_SHARE = 0.02
"""Clearances where nobody says otherwise, as a share of the longest leg."""
CLEARANCES = ("other_leg", "own_leg", "base", "ground")


class LeggedRobot:
    """Immutable after construction; pickles as what it was made of, which is ``description``.

    layout: its legs and joints by name. coupling: which joints follow others of their leg.
    joint_names: leg after leg, each from the base to the foot; postures are angles in that order, (joints,) [rad or m].
    slices: where each leg's joints are in a posture. limbs: what solves each leg. lower, upper: (joints,), of joints
    that turn further than once those of one turn, but where a closed form counts their turns (limb/by_structure.py).
    efforts: (joints,) [N·m or N], stiffness: (joints,) [N·m/rad or N/m]; inf where the description does not say, and
    of followers, whose leaders' motors move them.
    parents: for each body the body that carries it, −1 for the base, which is body 0; body 1 + j is what joint j moves.
    members: for each body the links that are part of it, each with its T_body_link (4, 4).
    shapes: for each body its collision shapes in the frame of its joint; corners: (n, 3) of the hull of them.
    speeds: (joints,) [rad/s or m/s], inf where it is not said. axes: of joints, (joints, 3) in their bodies. radii:
    (legs,) of soles [m]. foot_turns: for each leg (3, 3) of its foot link on its last body. length: of the longest leg
    [m]. clearances: least distances by CLEARANCES [m]. touching: pairs of bodies that touch as built.
    """

    def __init__(
        self,
        model: LeggedModel,
        postures: Mapping[str, Mapping[str, float]] | None = None,
        clearances: Mapping[str, float] | None = None,
        always: tuple[tuple[str, str], ...] = (),
        cameras: tuple[CameraPairSpec, ...] = (),
    ) -> None:
        self._made_of = model, postures, clearances, always, cameras
        self.description = _in_order(model, postures or {}, clearances or {}, always, cameras)
        self.layout = self.description.layout
        tree = model.tree
        joints = [joint for leg in model.legs for joint in _walking(model, leg)]
        self.model, self.name = model, tree.name
        self.legs = range(len(model.legs))
        self.joint_names = tuple(joint.name for joint in joints)
        ends = np.cumsum([0] + [len(leg.joints) for leg in model.legs])
        self.slices = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
        self.coupling = coupling_of(tree, joints)
        free = self.coupling.free
        self.efforts = np.where(free, [one.effort if one.effort > 0 else np.inf for one in joints], np.inf)
        self.speeds = np.array([one.velocity if one.velocity > 0 else np.inf for one in joints])
        self.stiffness = np.where(free, [one.stiffness if one.stiffness > 0 else np.inf for one in joints], np.inf)
        self.axes = np.array([joint.axis for joint in joints])
        self.radii = np.array([leg.sole.radius for leg in model.legs])
        self.length = longest_leg(model)
        own = dict.fromkeys(CLEARANCES, CLEARANCE_SHARE * self.length)
        self.clearances = own | dict(clearances or {})
        self.postures = {name: self._posture(name, posture) for name, posture in (postures or {}).items()}
        carrier, Ts_root_link = self._carriers(joints)
        index = {model.base: 0} | {joint.child: 1 + j for j, joint in enumerate(joints)}
        self.parents = tuple([-1] + [index[carrier[joint.parent]] for joint in joints])
        self.members = self._members(index, carrier, Ts_root_link)
        self.pin_model = self._pin_model(joints, carrier, Ts_root_link)
        self.gravity_models = tuple(_with_gravity(self.pin_model, axis) for axis in np.eye(3))
        self.mass = float(sum(inertia.mass for inertia in self.pin_model.inertias))
        self.shapes = tuple(
            tuple(Mesh(apply(T, one.points), one.mesh.triangles) for T, link in members for one in link.shapes)
            for members in self.members
        )
        self.corners = tuple(_corners(shapes) for shapes in self.shapes)
        self.body_names = tuple([model.base] + [joint.child for joint in joints])
        self.touching = frozenset(
            (min(pair), max(pair)) for a, b in always if len(pair := {index[carrier[a]], index[carrier[b]]}) == 2
        )
        self.foot_turns = tuple(
            (inverse(Ts_root_link[carrier[leg.foot]]) @ Ts_root_link[leg.foot])[:3, :3] for leg in model.legs
        )
        self.foot_frames = tuple(self.pin_model.getFrameId(f"sole {leg.name}") for leg in model.legs)
        endless = [tree.joint(leg.joints[0]).kind == "continuous" for leg in model.legs]
        places = (limb_of(self.pin_model, f"sole {leg.name}", "point") for leg in model.legs)
        couplings = map(self.coupling.part, self.slices)
        self.limbs = tuple(map(solver_of, places, endless, couplings))
        self.lower = np.concatenate([solver.limb.lower for solver in self.limbs])
        self.upper = np.concatenate([solver.limb.upper for solver in self.limbs])

    @classmethod
    def of(cls, about: DescribedRobot) -> "LeggedRobot":
        """The robot of a stored description."""
        return cls(about.model, about.postures, about.clearances, about.always, about.cameras)

    def __reduce__(self) -> tuple:
        return LeggedRobot, self._made_of

    def __repr__(self) -> str:
        return f"LeggedRobot({self.name!r}, legs={len(self.legs)})"

    @property
    def leg_names(self) -> tuple[str, ...]:
        """Names of the legs, in the order of the model."""
        return tuple(leg.name for leg in self.model.legs)

    @property
    def rolls(self) -> bool:
        """Whether a foot rolls where it stands: a ball or a disc does, a point stays."""
        return bool(self.radii.any())

    @property
    def sags(self) -> bool:
        """Whether it is known how every joint gives way; else it is taken as rigid."""
        return self.description.sags

    @property
    def digest(self) -> str:
        """Content name of the description: clearances and what may touch decide what is planned with it, too."""
        return self.description.digest

    def require_posture(self, posture: ArrayLike) -> Array:
        """The posture as float64 (joints,); raises InvalidInput unless it has that many finite numbers."""
        q = np.asarray(posture, float)
        if q.shape != (len(self.joint_names),) or not np.isfinite(q).all():
            raise InvalidInput(f"a posture of {self.name} needs {len(self.joint_names)} finite numbers")
        return q

    def require_leg(self, leg: int) -> int:
        """The leg number; raises InvalidInput unless the robot has that leg."""
        if leg not in self.legs:
            raise InvalidInput(f"{self.name} has legs 0 to {len(self.legs) - 1}", leg=str(leg))
        return int(leg)

    def posture(self, name: str) -> Array:
        """Angles of a named posture (joints,); raises NotFound naming those that exist."""
        if name not in self.postures:
            known = ", ".join(self.postures) or "none"
            raise NotFound(f"{self.name} has no posture {name!r}; it has {known}")
        return self.postures[name].copy()

    def _posture(self, name: str, posture: Mapping[str, float]) -> Array:
        """Its angles (joints,); raises InvalidRobot for a joint that the robot does not have: it may be misspelled."""
        unknown = sorted(set(posture) - {joint.name for joint in self.model.tree.joints})
        if unknown:
            raise InvalidRobot(f"posture {name}: the URDF has no joint {unknown[0]!r}", joints=unknown)
        return self.coupling.followed(np.array([float(posture.get(name, 0.0)) for name in self.joint_names]))

    def _carriers(self, joints: list[TreeJoint]) -> tuple[dict[str, str], dict[str, Array]]:
        """Link → first link of the body that carries it; link → (4, 4) in the root with all legs at zero."""
        tree = self.model.tree
        walking = {joint.name for joint in joints}
        carrier = {tree.root: tree.root}
        for joint in tree.joints:
            carrier[joint.child] = joint.child if joint.name in walking else carrier[joint.parent]
        return carrier, tree.poses(self._held())

    def _held(self) -> dict[str, float]:
        """Where joints are that are no leg's; raises InvalidRobot where the robot.toml has one outside its limits."""
        postures = self.description.postures
        held, said = held_joints(self.model, postures), postures.get(STAND, {})
        for name in (one for one in held if one in said):
            joint, angle = self.model.tree.joint(name), said[name]
            if angle < joint.lower or angle > joint.upper:
                limits = f"{joint.lower:g} … {joint.upper:g}"
                raise InvalidRobot(f"posture {STAND}: {name} at {angle:g} is outside its limits {limits}")
        return held

    def _pin_model(
        self, joints: list[TreeJoint], carrier: Mapping[str, str], Ts_root_link: Mapping[str, Array]
    ) -> pin.Model:
        pinned, ids = pin.Model(), {self.model.base: 0}
        pinned.name = self.name
        limits = limits_of(joints, self.coupling)
        for number, joint in enumerate(joints):
            on = carrier[joint.parent]
            T_on_joint = inverse(Ts_root_link[on]) @ Ts_root_link[joint.child]
            if self.coupling.offsets[number]:  # with its leader at zero it is not
                T_on_joint = T_on_joint @ joint.motion(-self.coupling.offsets[number])
            slides = joint.kind == "prismatic"
            kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
            bounds = (np.array([one]) for one in (1e9, 1e9, *limits[number]))
            ids[joint.child] = pinned.addJoint(ids[on], kind(joint.axis), pin.SE3(T_on_joint), joint.name, *bounds)
        for number, members in enumerate(self.members):
            for T_body_link, link in members:
                if link.mass > 0:
                    # statics ask for mass and centre alone, and strangers' inertias need not be sound
                    inertia = pin.Inertia(link.mass, link.center, np.zeros((3, 3)))
                    pinned.appendBodyToJoint(number, inertia, pin.SE3(T_body_link))
        for leg in self.model.legs:
            body = carrier[leg.foot]
            T_body_sole = inverse(Ts_root_link[body]) @ Ts_root_link[leg.foot]
            T_body_sole[:3, 3] = apply(T_body_sole, leg.sole.center)
            place = pin.SE3(T_body_sole)
            pinned.addFrame(pin.Frame(f"sole {leg.name}", ids[body], place, pin.FrameType.OP_FRAME))
        return pinned

    def _members(
        self, index: Mapping[str, int], carrier: Mapping[str, str], Ts_root_link: Mapping[str, Array]
    ) -> tuple[tuple[tuple[Array, TreeLink], ...], ...]:
        found: list[list[tuple[Array, TreeLink]]] = [[] for _ in index]
        for link in self.model.tree.links:
            body = carrier[link.name]
            found[index[body]].append((inverse(Ts_root_link[body]) @ Ts_root_link[link.name], link))
        return tuple(map(tuple, found))


def _in_order(
    model: LeggedModel,
    postures: Mapping[str, Mapping[str, float]],
    clearances: Mapping[str, float],
    always: tuple[tuple[str, str], ...],
    cameras: tuple[CameraPairSpec, ...],
) -> DescribedRobot:
    """The description, the same in whatever order its parts are given."""
    named = {name: dict(sorted(postures[name].items())) for name in sorted(postures)}
    pairs = {(min(pair), max(pair)) for pair in always}
    return DescribedRobot(model, named, dict(sorted(clearances.items())), tuple(sorted(pairs)), cameras)


def _walking(model: LeggedModel, leg: LegChain) -> list[TreeJoint]:
    """Joints of a leg; raises InvalidRobot where the leg can't walk, saying why."""
    reason = why_unable(model.tree, leg)
    if reason:
        raise InvalidRobot(f"leg {leg.name} can't walk: {reason}")
    return [model.tree.joint(name) for name in leg.joints]


def _with_gravity(model: pin.Model, gravity: Array) -> pin.Model:
    copy = model.copy()
    copy.gravity = pin.Motion(gravity, np.zeros(3))
    return copy


def _corners(shapes: tuple[Mesh, ...]) -> Array:
    """Corners of the convex hull of all of them, (n, 3) [m]; (0, 3) for none."""
    if not shapes:
        return np.zeros((0, 3))
    points = np.concatenate([mesh.vertices for mesh in shapes])
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:
        # flat: its corners are among its points
        return np.unique(points, axis=0)
