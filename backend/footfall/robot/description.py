"""The robot description: everything FootFall knows of a rover, as one value.

Legs are numbered from 0; each has the six joints of :data:`JOINTS` and a wheel. Frames: ``base``
(x forward, y left, z up; the top of ATHLETE's ring is z = 0) and for each leg ``hip`` (x radially out,
z up; where the hip-yaw joint is at zero). Links are ``base`` and ``leg<i>_<part>`` for the parts of
:data:`PARTS`; joints are ``leg<i>_<part>_joint``. A link's frame is its joint's; the wheel's frame is
the ankle-roll frame moved along x to the wheel centre, axle = y.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.errors import InvalidRobot, NotFound
from footfall.core.frames import require_transform
from footfall.core.mesh import Mesh
from footfall.core.value import Value, value
from footfall.telemetry.images import Camera
from footfall.telemetry.joint_layout import JointLayout

JOINTS = (
    ("hip_yaw", "z"),
    ("hip_pitch", "y"),
    ("knee_pitch", "y"),
    ("knee_roll", "x"),
    ("ankle_pitch", "y"),
    ("ankle_roll", "x"),
)
"""The one leg structure that the closed-form inverse kinematics solves: joint names and axes in order."""

PARTS = (*(name for name, _ in JOINTS), "wheel")
"""Links of one leg, from the chassis outward."""


def link_name(leg: int, part: str) -> str:
    """Name of a leg's link: ``leg2_knee_roll``."""
    return f"leg{leg}_{part}"


def joint_name(leg: int, part: str) -> str:
    """Name of the joint that moves that link: ``leg2_knee_roll_joint``."""
    return f"leg{leg}_{part}_joint"


def athlete_layout(leg_count: int) -> JointLayout:
    """Legs and joints of a robot of ATHLETE's build."""
    legs = range(leg_count)
    return JointLayout(
        tuple(f"leg{leg}" for leg in legs), tuple(tuple(joint_name(leg, part) for part, _ in JOINTS) for leg in legs)
    )


@value
class Leg(Value):
    """Geometry of one leg.

    T_base_hip: (4, 4) mount of the hip-yaw joint; x radially out.
    hip_offset: hip yaw → hip pitch, (3,) [m]; y is 0.
    thigh, shank, foot: hip pitch → knee, knee → ankle centre, ankle centre → wheel centre [m].
    link_names: the seven links from hip yaw to wheel.
    """

    T_base_hip: NDArray[np.float64]
    hip_offset: NDArray[np.float64]
    thigh: float
    shank: float
    foot: float
    link_names: tuple[str, ...]

    def check(self) -> None:
        """Raises InvalidRobot for a hip pitch joint off the leg's plane, and for lengths that are not above zero."""
        require_transform(self.T_base_hip, "T_base_hip")
        if self.hip_offset.shape != (3,) or self.hip_offset[1] != 0.0:
            raise InvalidRobot("the hip pitch joint must lie in the leg's plane: the offset's y must be 0")
        for name in ("thigh", "shank", "foot"):
            if not getattr(self, name) > 0:
                raise InvalidRobot(f"the {name} must be longer than zero", length=getattr(self, name))

    @property
    def reaches(self) -> NDArray[np.float64]:
        """How far from the hip-yaw joint the frame of each link can get, (7,) in the order of PARTS [m]."""
        hip = float(np.linalg.norm(self.hip_offset))
        return np.cumsum((0.0, hip, self.thigh, 0.0, self.shank, 0.0, self.foot))


@value
class CameraPairSpec(Value):
    """A stereo pair on the chassis."""

    name: str
    camera_left: Camera
    camera_right: Camera


@value
class PartPair(Value):
    """Two parts of one leg that are checked against each other, and the least distance [m]."""

    part_a: str
    part_b: str
    distance: float


@value
class Clearances(Value):
    """Least distances δ between links [m]; pairs that stand nowhere here are not checked.

    chassis: part → δ to the chassis. terrain: part → δ to the ground. own_leg: pairs within a leg.
    payload: any link of a leg to the payload. other_leg: links of two legs. chassis_terrain: chassis or
    payload to the ground. wheel_sink: the wheel that touches the ground is checked with its mesh
    smaller by this much all round.
    """

    chassis: Mapping[str, float]
    terrain: Mapping[str, float]
    own_leg: tuple[PartPair, ...]
    payload: float
    other_leg: float
    chassis_terrain: float
    wheel_sink: float

    def check(self) -> None:
        """Raises InvalidRobot where a part has no clearance to the terrain, and for ones negative or not finite."""
        if set(self.terrain) != set(PARTS):
            raise InvalidRobot(f"the clearances to the terrain must name every part: {', '.join(PARTS)}")
        pairs = {f"{pair.part_a} to {pair.part_b}": pair.distance for pair in self.own_leg}
        single = {name: getattr(self, name) for name in ("payload", "other_leg", "chassis_terrain", "wheel_sink")}
        for name, distance in {**self.chassis, **self.terrain, **pairs, **single}.items():
            if not 0 <= distance < np.inf:
                raise InvalidRobot(f"the clearance of {name} must be finite and not negative [m]", distance=distance)


@value
class Payload(Value):
    """A box fixed to the chassis. mass [kg]; size (3,) and position of its centre in base, (3,) [m]."""

    mass: float
    size: NDArray[np.float64]
    position: NDArray[np.float64]

    def check(self) -> None:
        """Raises InvalidRobot for a mass or size that is not above zero, and for a position that is not finite."""
        if not 0 < self.mass < np.inf:
            raise InvalidRobot("a payload needs a mass above zero [kg]; without one, leave the payload out")
        if self.size.shape != (3,) or not (np.isfinite(self.size) & (self.size > 0)).all():
            raise InvalidRobot("the payload's size needs three lengths above zero [m]")
        if self.position.shape != (3,) or not np.isfinite(self.position).all():
            raise InvalidRobot("the payload's position needs three finite numbers [m]")


@value
class RobotDescription(Value):
    """One rover; arrays over joints are leg by leg in the order of ``joint_names``.

    urdf: its URDF text (without payload). meshes: link name → mesh in the link's frame.
    lower, upper [rad]; torque_limits [N·m]; speed_limits [rad/s]; stiffness [N·m/rad]: (legs × 6,).
    wheel_radius, wheel_width [m]; wheel_stiffness: radial [N/m].
    postures: name → (legs × 6,) [rad]. assumed: what in the description has no source.
    """

    name: str
    urdf: str
    meshes: Mapping[str, Mesh]
    legs: tuple[Leg, ...]
    joint_names: tuple[str, ...]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    torque_limits: NDArray[np.float64]
    speed_limits: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    wheel_radius: float
    wheel_width: float
    wheel_stiffness: float
    wheel_sides: int
    postures: Mapping[str, NDArray[np.float64]]
    cameras: tuple[CameraPairSpec, ...]
    clearances: Clearances
    payload: Payload | None
    assumed: tuple[str, ...]

    def check(self) -> None:
        """Raises InvalidRobot for arrays that lack joints, limits out of order, and postures outside them."""
        count = 6 * len(self.legs)
        for name in ("lower", "upper", "torque_limits", "speed_limits", "stiffness"):
            array = getattr(self, name)
            if array.shape != (count,) or not np.isfinite(array).all():
                raise InvalidRobot(f"{self.name}: {name} needs {count} finite numbers", shape=list(array.shape))
            if name not in ("lower", "upper") and not (array > 0).all():
                raise InvalidRobot(f"{self.name}: {name} must be above zero")
        if not (self.lower < self.upper).all():
            joint = self.joint_names[int(np.argmin(self.upper - self.lower))]
            raise InvalidRobot(f"{self.name}: the lower limit of {joint} must be below its upper limit")
        for name, posture in self.postures.items():
            if posture.shape != (count,) or not np.isfinite(posture).all():
                raise InvalidRobot(f"{self.name}: posture {name!r} needs {count} finite angles")
            outside = np.flatnonzero((posture < self.lower) | (posture > self.upper))
            if outside.size:
                raise InvalidRobot(f"{self.name}: posture {name!r} breaks the limit of {self.joint_names[outside[0]]}")
        if not 2 * self.clearances.wheel_sink < min(self.wheel_width, 2 * self.wheel_radius):
            raise InvalidRobot(f"{self.name}: wheel_sink leaves nothing of the wheel")
        names = [pair.name for pair in self.cameras]
        if len(set(names)) != len(names):
            raise InvalidRobot(f"{self.name}: two camera pairs have one name", names=names)

    def camera_pair(self, name: str) -> CameraPairSpec:
        """The stereo pair of that name; raises NotFound naming those that exist."""
        for pair in self.cameras:
            if pair.name == name:
                return pair
        raise NotFound(f"{self.name} has no camera pair {name!r}; it has {', '.join(p.name for p in self.cameras)}")


BOX, ON_DECK = (1.2, 1.2, 0.6), (0.0, 0.0, 0.3)
"""Size of a payload's box, and its middle in base, where nobody says others: it stands on the deck [m]."""


def with_payload(
    description: RobotDescription,
    mass: float,
    size: ArrayLike = BOX,
    position: ArrayLike = ON_DECK,
) -> RobotDescription:
    """The same rover carrying a box.

    Args:
        description: of the rover.
        mass: of the box [kg]; 0 takes the payload away.
        size: (3,) [m].
        position: of the box's centre in base, (3,) [m] (z = size/2: standing on the deck).

    Returns:
        Its description.
    """
    payload = None if mass == 0 else Payload(float(mass), np.asarray(size, float), np.asarray(position, float))
    fields = {name: getattr(description, name) for name in description.__dataclass_fields__}
    return RobotDescription(**{**fields, "payload": payload})
