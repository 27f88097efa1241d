"""A robot as a tree of links and joints: what a foreign description says, before anything is made of it.

Frames as in URDF: a link's frame is that of the joint which carries it; a joint turns about (or slides along) its axis.
"""

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidRobot
from footfall.core.frames import apply, require_transform, transform
from footfall.core.mesh import Mesh
from footfall.core.value import LATER, Value, value

MOVING = ("revolute", "continuous", "prismatic")
JOINT_KINDS = (*MOVING, "fixed")
SHAPE_KINDS = ("box", "cylinder", "sphere", "mesh")


@value
class TreeShape(Value):
    """One collision shape of a link.

    T_link_shape: (4, 4). size: edges of a box; radius, radius, length of a cylinder (along z); three times the radius
    of a sphere; extents of a mesh, (3,) [m]. mesh: the shape's surface in its own frame. source: the mesh's file name.
    """

    kind: str
    T_link_shape: NDArray[np.float64]
    size: NDArray[np.float64]
    mesh: Mesh
    source: str = ""

    def check(self) -> None:
        """Raises InvalidRobot for a kind that is none of SHAPE_KINDS."""
        require_transform(self.T_link_shape, "T_link_shape")
        if self.kind not in SHAPE_KINDS:
            raise InvalidRobot(f"a shape is one of {', '.join(SHAPE_KINDS)}, not {self.kind!r}")

    @property
    def points(self) -> NDArray[np.float64]:
        """The surface's vertices in the link's frame, (n, 3) [m]."""
        return apply(self.T_link_shape, self.mesh.vertices)


@value
class TreeLink(Value):
    """mass [kg], 0 where none is said; center: of mass, (3,) [m]; inertia: about it, in the link's axes [kg·m²]."""

    name: str
    mass: float
    center: NDArray[np.float64]
    inertia: NDArray[np.float64]
    shapes: tuple[TreeShape, ...]


@value
class TreeJoint(Value):
    """T_parent_joint: (4, 4) at zero; axis: (3,) unit vector in the joint's frame.

    lower, upper [rad or m]; effort [N·m or N]; velocity [rad/s or m/s]; stiffness of the joint that is held at a place
    [N·m/rad or N/m]: NaN where the description does not say.
    mimic: name of the joint that this one follows, angle = multiplier × its angle + offset; empty for a free one.
    """

    name: str
    kind: str
    parent: str
    child: str
    T_parent_joint: NDArray[np.float64]
    axis: NDArray[np.float64]
    lower: float
    upper: float
    effort: float
    velocity: float
    mimic: str = ""
    multiplier: float = 1.0
    offset: float = 0.0
    stiffness: float = field(default=float("nan"), metadata=LATER)

    @property
    def moves(self) -> bool:
        """Whether it turns or slides; a fixed joint doesn't."""
        return self.kind in MOVING

    def motion(self, q: float) -> NDArray[np.float64]:
        """(4, 4) of the joint's own motion by q [rad or m]; Rodrigues' formula."""
        if self.kind == "fixed":
            return np.eye(4)
        if self.kind == "prismatic":
            return transform(translation=q * self.axis)
        x, y, z = self.axis
        K = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
        return transform(np.eye(3) + np.sin(q) * K + (1 - np.cos(q)) * K @ K)

    @property
    def neutral(self) -> float:
        """Zero where the limits allow it, otherwise their middle [rad or m]."""
        if self.kind == "continuous" or not np.isfinite([self.lower, self.upper]).all():
            return 0.0
        return 0.0 if self.lower <= 0.0 <= self.upper else (self.lower + self.upper) / 2


@value
class RobotTree(Value):
    """links: the root first; joints: each after the one that carries its parent. Raises InvalidRobot for no tree."""

    name: str
    links: tuple[TreeLink, ...]
    joints: tuple[TreeJoint, ...]

    def check(self) -> None:
        """Raises InvalidRobot for links and joints that are no tree in which each hangs from the root."""
        seen = {self.links[0].name}
        for joint in self.joints:
            if joint.parent not in seen or joint.child in seen:
                raise InvalidRobot(f"{self.name}: joint {joint.name} does not stand in a tree, parents first")
            seen.add(joint.child)
        if seen != {link.name for link in self.links} or len(seen) != len(self.links):
            raise InvalidRobot(f"{self.name}: every link must hang from the root {self.root} by joints")

    @property
    def root(self) -> str:
        """Name of the link that hangs from no joint."""
        return self.links[0].name

    @property
    def mass(self) -> float:
        """Of all links [kg]."""
        return float(sum(link.mass for link in self.links))

    def link(self, name: str) -> TreeLink:
        """The link of that name, which must be there."""
        return next(link for link in self.links if link.name == name)

    def joint(self, name: str) -> TreeJoint:
        """The joint of that name, which must be there."""
        return next(joint for joint in self.joints if joint.name == name)

    def bodies(self) -> Mapping[str, str]:
        """Link → the first link of the rigid body that it is part of: what fixed joints join is one body."""
        first = {self.root: self.root}
        for joint in self.joints:
            first[joint.child] = joint.child if joint.moves else first[joint.parent]
        return first

    def members(self, body: str) -> tuple[TreeLink, ...]:
        """Links of the rigid body that begins with that link."""
        first = self.bodies()
        return tuple(link for link in self.links if first[link.name] == body)

    def free(self) -> tuple[TreeJoint, ...]:
        """Joints that move and follow no other."""
        return tuple(joint for joint in self.joints if joint.moves and not joint.mimic)

    def neutral(self) -> dict[str, float]:
        """Joint → angle of the posture in the middle: see TreeJoint.neutral."""
        return {joint.name: joint.neutral for joint in self.free()}

    def poses(self, posture: Mapping[str, float]) -> dict[str, NDArray[np.float64]]:
        """Link → (4, 4) T_root_link at a posture: joint → angle [rad or m]; others are at zero."""
        angles = {joint.name: float(posture.get(joint.name, 0.0)) for joint in self.free()}
        Ts_root_link = {self.root: np.eye(4)}
        for joint in self.joints:
            q = self._angle(joint, angles) if joint.moves else 0.0
            Ts_root_link[joint.child] = Ts_root_link[joint.parent] @ joint.T_parent_joint @ joint.motion(q)
        return Ts_root_link

    def _angle(self, joint: TreeJoint, angles: Mapping[str, float]) -> float:
        if not joint.mimic:
            return angles[joint.name]
        return joint.multiplier * self._angle(self.joint(joint.mimic), angles) + joint.offset
