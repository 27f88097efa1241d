"""The rover and its ground as a MuJoCo model, every number from the RobotDescription and the Dem.

The chassis is free; every joint is a hinge under a damped position servo: torque = stiffness · (set point − angle).
The wheel is locked to its link: its rim is a body of its own on three springs along the axes of that link, so it
rolls over the ground only as the leg turns it. Link meshes are convex and taken as they are. Which links may
touch is asked of the description: the pairs that the collision checks watch make contact here, no others.
"""

import logging
from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.core.frames import quat_wxyz
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.core.value import Provenance
from footfall.robot.description import JOINTS, PARTS, Payload, link_name
from footfall.robot.meshes.bvh import PAYLOAD
from footfall.robot.meshes.shapes import box
from footfall.robot.model import Robot
from footfall.sim.physics.physics_settings import (
    ARMATURE,
    DAMPING_TIME,
    RIM_DAMPING,
    RIM_INERTIA,
    RIM_MASS,
    TIME_STEP,
    PhysicsSettings,
)
from footfall.terrain.dem import MAX_CELLS, Dem

# or else the library writes a file of its own
mujoco.set_mju_user_warning(logging.getLogger("footfall.sim.physics").warning)

TERRAIN = "terrain"
CHASSIS = "base"

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_MARGIN = 4.0
"""How far the ground goes on past the map's edge, as high as there, where the largest map leaves room for it [m]."""
_BASEMENT = 5.0
"""How thick the ground is below its lowest place [m]."""
_GROUND_BIT, _CHASSIS_BIT, _PAYLOAD_BIT = 1, 2, 4
_FIRST_LEG_BIT = 3


@dataclass(frozen=True)
class PhysicsModel:
    """A compiled model and where in it things are.

    model: MuJoCo's. joints, speeds: indices of the joint angles in qpos and of their rates in qvel, (legs × 6,).
    rims: index of each wheel's rim body, (legs,). tread: geom of each wheel that meets the ground, (legs,).
    ground, chassis: the terrain's geom; those of the chassis and its payload. geom_names: what each geom is, as
    the collision checks name it. stiffness: of the joints as simulated, (legs × 6,) [N·m/rad]; wheel_stiffness (legs,)
    [N/m]. heights: the whole ground without holes.
    """

    model: mujoco.MjModel
    joints: NDArray[np.int64]
    speeds: NDArray[np.int64]
    rims: NDArray[np.int64]
    tread: NDArray[np.int64]
    wheel_of: NDArray[np.int64]
    ground: int
    chassis: tuple[int, ...]
    geom_names: tuple[str, ...]
    stiffness: Array
    wheel_stiffness: Array
    heights: Dem


def build_model(robot: Robot, dem: Dem, settings: PhysicsSettings) -> PhysicsModel:
    """The rover over its ground. Raises InvalidRobot where the last link is too light to carry a rim."""
    rng = np.random.default_rng([settings.seed, 1])
    description = robot.description
    joint_factors = 1 + settings.stiffness_spread * rng.uniform(-1, 1, 6 * robot.leg_count)
    wheel_factors = 1 + settings.wheel_spread * rng.uniform(-1, 1, robot.leg_count)
    stiffness = description.stiffness * settings.stiffness_scale * joint_factors
    wheel_stiffness = description.wheel_stiffness * settings.wheel_scale * wheel_factors
    spec = mujoco.MjSpec()
    set_options(spec, settings)
    ground = whole_ground(dem)
    add_ground(spec, ground)
    for name, mesh in description.meshes.items():
        _add_mesh(spec, name, mesh)
    base = spec.worldbody.add_body(name=CHASSIS)
    base.add_freejoint(name="free")
    _add_geom(base, CHASSIS, CHASSIS, _CHASSIS_BIT, _GROUND_BIT)
    if description.payload is not None:
        _add_mesh(spec, PAYLOAD, box(description.payload.size, description.payload.position))
        _add_geom(base, PAYLOAD, PAYLOAD, _PAYLOAD_BIT, _GROUND_BIT)
    set_inertial(base, *_with_payload(robot, description.payload), settings.mass_scale)
    for leg in robot.legs:
        _add_leg(spec, base, robot, leg, settings, stiffness, float(wheel_stiffness[leg]))
    for geom in spec.geoms:
        geom.friction = (settings.friction, 0.0, 0.0)
        geom.solref = (0.01, 1.0)
    for pair in spec.pairs:
        pair.friction = (settings.friction, settings.friction, 0.0, 0.0, 0.0)
        pair.solref = (0.01, 1.0)
    model = spec.compile()
    joints = [model.joint(name) for name in robot.joint_names]
    names = [model.geom(i).name for i in range(model.ngeom)]
    tread = np.array([names.index(f"tread{leg}") for leg in robot.legs], np.int64)
    wheel_of = np.full(model.ngeom, -1, np.int64)
    wheel_of[tread] = np.arange(robot.leg_count)
    return PhysicsModel(
        model=model,
        joints=np.array([joint.qposadr[0] for joint in joints], np.int64),
        speeds=np.array([joint.dofadr[0] for joint in joints], np.int64),
        rims=np.array([model.body(f"rim{leg}").id for leg in robot.legs], np.int64),
        tread=tread,
        wheel_of=wheel_of,
        ground=int(model.geom(TERRAIN).id),
        chassis=tuple(i for i, name in enumerate(names) if name in (CHASSIS, PAYLOAD)),
        geom_names=tuple(
            link_name(int(name.removeprefix("tread")), "wheel") if name.startswith("tread") else name for name in names
        ),
        stiffness=stiffness,
        wheel_stiffness=wheel_stiffness,
        heights=ground,
    )


def set_options(spec: mujoco.MjSpec, settings: PhysicsSettings) -> None:
    # Held in trials: without noslip the standing rover creeps centimetres in half a minute.
    spec.option.timestep = TIME_STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.noslip_iterations = 5
    # what diverges is to be seen, not begun anew
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET
    # a rover that falls in a heap has many contacts
    spec.memory = 1 << 26
    spec.option.gravity = (0.0, 0.0, -settings.gravity)


def whole_ground(dem: Dem) -> Dem:
    """The ground without holes, and farther than the map goes.

    Ground that nobody knows is as high as the nearest that is known, and past the edge it goes on as at the edge:
    a wheel finds something to stand on wherever it goes.
    """
    heights = np.asarray(dem.heights)
    unknown = np.isnan(heights)
    if unknown.any():
        nearest = np.asarray(distance_transform_edt(unknown, return_distances=False, return_indices=True))
        heights = heights[nearest[0], nearest[1]]
    grid = dem.geometry
    room = (int(MAX_CELLS**0.5) - max(heights.shape)) // 2
    cells = max(0, min(room, int(np.ceil(_MARGIN / grid.resolution))))
    heights = np.pad(heights, cells, mode="edge")
    margin = cells * grid.resolution
    geometry = GridGeometry(grid.x0 - margin, grid.y0 - margin, grid.resolution, *heights.shape)
    return Dem(heights, geometry, dem.name, Provenance({}))


def add_ground(spec: mujoco.MjSpec, ground: Dem) -> None:
    """The Dem as a height field: the same triangles as :mod:`footfall.terrain.ground.triangulate`."""
    heights, grid = ground.heights.astype(float), ground.geometry
    low = float(heights.min())
    span = max(float(heights.max()) - low, 1e-3)
    half = np.array([grid.cols - 1, grid.rows - 1]) * grid.resolution / 2
    spec.add_hfield(
        name=TERRAIN,
        size=(half[0], half[1], span, _BASEMENT),
        nrow=grid.rows,
        ncol=grid.cols,
        userdata=((heights - low) / span).ravel().astype(np.float32),
    )
    spec.worldbody.add_geom(
        name=TERRAIN,
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname=TERRAIN,
        pos=(grid.x0 + half[0], grid.y0 + half[1], low),
        contype=_GROUND_BIT,
        conaffinity=0,
    )


def _add_leg(
    spec: mujoco.MjSpec,
    base: mujoco.MjsBody,
    robot: Robot,
    leg: int,
    settings: PhysicsSettings,
    stiffness: Array,
    wheel_stiffness: float,
) -> None:
    deltas = robot.description.clearances
    own_bit = 1 << (_FIRST_LEG_BIT + leg)
    other_legs = sum(1 << (_FIRST_LEG_BIT + other) for other in robot.legs if other != leg)
    meets = _GROUND_BIT | _PAYLOAD_BIT | other_legs
    body = base
    for i, (part, axis) in enumerate(JOINTS):
        joint, name = 6 * leg + i, link_name(leg, part)
        T = robot.model.jointPlacements[joint + 1]
        body = body.add_body(name=name, pos=T.translation, quat=quat_wxyz(T.rotation))
        k = float(stiffness[joint])
        body.add_joint(
            name=robot.joint_names[joint],
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=_AXES[axis],
            damping=(DAMPING_TIME * k, 0.0, 0.0),
            armature=ARMATURE,
        )
        servo = spec.add_actuator(
            name=robot.joint_names[joint],
            target=robot.joint_names[joint],
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
        )
        servo.set_to_position(kp=k)
        _add_geom(body, name, name, own_bit, meets | (_CHASSIS_BIT if part in deltas.chassis else 0))
        inertia = robot.model.inertias[joint + 1]
        if i < len(JOINTS) - 1:
            set_inertial(body, inertia.mass, inertia.lever, inertia.inertia, settings.mass_scale)
        else:
            hub = np.array([robot.description.legs[leg].foot, 0.0, 0.0])
            set_inertial(body, *_without_rim(robot, inertia, hub), settings.mass_scale)
            _add_rim(body, robot, leg, hub, wheel_stiffness, settings)
            wheel_meets = other_legs | _PAYLOAD_BIT | (_CHASSIS_BIT if "wheel" in deltas.chassis else 0)
            wheel = link_name(leg, "wheel")
            _add_geom(body, wheel, wheel, own_bit, wheel_meets).pos = hub
    for pair in deltas.own_leg:
        spec.add_pair(geomname1=link_name(leg, pair.part_a), geomname2=link_name(leg, pair.part_b), condim=3)
    if robot.description.payload is not None:
        # MuJoCo leaves out parent and child, but the payload is a thing of its own
        spec.add_pair(geomname1=link_name(leg, PARTS[0]), geomname2=PAYLOAD, condim=3)


def _add_rim(
    foot: mujoco.MjsBody, robot: Robot, leg: int, hub: Array, wheel_stiffness: float, settings: PhysicsSettings
) -> None:
    rim = foot.add_body(name=f"rim{leg}", pos=hub)
    for axis, direction in _AXES.items():
        rim.add_joint(
            name=f"rim{leg}_{axis}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=direction,
            stiffness=(wheel_stiffness, 0.0, 0.0),
            damping=(RIM_DAMPING, 0.0, 0.0),
        )
    set_inertial(rim, RIM_MASS, np.zeros(3), RIM_INERTIA * np.eye(3), settings.mass_scale)
    radius, half_width = robot.wheel_radius, robot.description.wheel_width / 2
    crowned = settings.wheel_shape == "crowned"
    rim.add_geom(
        name=f"tread{leg}",
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID if crowned else mujoco.mjtGeom.mjGEOM_SPHERE,
        size=(radius, half_width, radius) if crowned else (radius, 0.0, 0.0),
        contype=0,
        conaffinity=_GROUND_BIT,
    )


def _with_payload(robot: Robot, payload: Payload | None) -> tuple[float, Array, Array]:
    """Mass, centre and inertia about it of the chassis with what it carries; the payload is a solid box."""
    chassis = robot.model.inertias[0]
    if payload is None:
        return chassis.mass, chassis.lever, chassis.inertia
    x, y, z = payload.size**2
    box_inertia = payload.mass / 12 * np.diag([y + z, z + x, x + y])
    mass = chassis.mass + payload.mass
    center = (chassis.mass * chassis.lever + payload.mass * payload.position) / mass
    inertia = chassis.inertia + _shifted(chassis.mass, chassis.lever - center)
    return mass, center, inertia + box_inertia + _shifted(payload.mass, payload.position - center)


def _without_rim(robot: Robot, whole: pin.Inertia, hub: Array) -> tuple[float, Array, Array]:
    """Mass, centre and inertia of the last link when its wheel's rim is a body of its own at the hub."""
    mass, center, inertia = whole.mass, whole.lever, whole.inertia
    rest = mass - RIM_MASS
    if rest <= 0:
        raise InvalidRobot(f"the last link of {robot.name} must be heavier than the {RIM_MASS:g} kg of a wheel's rim")
    rest_center = (mass * center - RIM_MASS * hub) / rest
    rest_inertia = (
        inertia - RIM_INERTIA * np.eye(3) - _shifted(RIM_MASS, hub - center) - _shifted(rest, rest_center - center)
    )
    moments = np.linalg.eigvalsh(rest_inertia)
    if not (moments[0] > 0 and moments[0] + moments[1] >= moments[2]):
        raise InvalidRobot(
            f"the last link of {robot.name} is too slight for a wheel's rim of {RIM_MASS:g} kg at the hub"
        )
    return rest, rest_center, rest_inertia


def _shifted(mass: float, arm: Array) -> Array:
    """Inertia that a point mass adds about a point ``arm`` away (parallel axes)."""
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def set_inertial(body: mujoco.MjsBody, mass: float, center: Array, inertia: Array, scale: float) -> None:
    body.explicitinertial = True
    body.mass = mass * scale
    body.ipos = center
    i = np.asarray(inertia) * scale
    body.fullinertia = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])


def _add_mesh(spec: mujoco.MjSpec, name: str, mesh: Mesh) -> None:
    spec.add_mesh(name=name, uservert=mesh.vertices.ravel(), userface=mesh.triangles.ravel())


def _add_geom(body: mujoco.MjsBody, name: str, mesh: str, contype: int, conaffinity: int) -> mujoco.MjsGeom:
    return body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh, contype=contype, conaffinity=conaffinity
    )
