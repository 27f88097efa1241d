"""A robot that others described and its ground as a MuJoCo model.

Masses, inertias, joints, shapes and soles are those of the description. How joints give way no URDF says: where the
robot.toml does not, SERVO_GIVE is assumed; DAMPING_TIME and ARMATURE_TIME always are, and ``assumed`` tells what else
is. Body pairs that the planner keeps apart make contact here, no others; every body meets the ground.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from footfall.balance.balance_settings import GRAVITY
from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.core.frames import quat_wxyz
from footfall.planning.legged.at_ease import at_ease
from footfall.planning.legged.over_ground import NEAR_SOLE
from footfall.robot.legged.judge_tree import inertia_fault, joined_inertia
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.sim.physics.model import add_ground, set_inertial, set_options, whole_ground
from footfall.sim.physics.physics_settings import PhysicsSettings
from footfall.terrain.dem import Dem

TICK = 0.002
"""Seconds between two states: these robots are lighter, and their joints quicker, than ATHLETE's."""
SERVO_GIVE, SERVO_GIVE_SLIDE = 0.05, 0.005
"""A joint at its whole effort is so far from its set point [rad, m]: assumed."""
DAMPING_TIME = 0.03
"""Damping of a joint over its stiffness [s]: assumed."""
ARMATURE_TIME = 0.01
"""Inertia of a motor and its gear, as the square of this time times the joint's stiffness [s]: assumed."""
LEAST_MASS, LEAST_SIZE, LEAST_RADIUS = 1e-3, 0.01, 2e-3
"""Of a body [kg], of the box that stands for it [m], of a sole [m]: points and nothing can't be simulated."""
_FAR_UP = 1e3
"""Where a robot meets no ground [m]."""
SOLREF = (0.01, 1.0)
"""How soft contacts are: MuJoCo's time constant [s] and damping ratio."""


@dataclass(frozen=True)
class LeggedPhysics:
    """model: MuJoCo's. joints, speeds: of each joint in qpos and qvel. soles: geom of each leg's sole. bodies: of each
    geom the robot's body, −1 for the ground. near: of each leg, how far from its sole's centre its last body may touch
    the ground, as in the planner [m]. stiffness: (joints,) as assumed [N·m/rad, N/m]. assumed: what is, in words.
    """

    model: mujoco.MjModel
    joints: NDArray[np.int64]
    speeds: NDArray[np.int64]
    soles: NDArray[np.int64]
    bodies: NDArray[np.int64]
    near: Array
    stiffness: Array
    assumed: tuple[str, ...]


def build_legged(robot: LeggedRobot, dem: Dem, settings: PhysicsSettings) -> LeggedPhysics:
    """The robot over its ground, its base where the model's frame is. Raises InvalidRobot for a shape that is flat."""
    spec = mujoco.MjSpec()
    set_options(spec, settings)
    spec.option.timestep = TICK
    add_ground(spec, whole_ground(dem))
    stiffness = _stiffness(robot, settings)
    bodies = _bodies(spec, robot, stiffness)
    _add_rods(spec, robot)
    near = robot.radii + NEAR_SOLE * robot.clearances["ground"]
    boxes = [
        robot.body_names[number]
        for number, body in enumerate(bodies)
        if not _set_mass(body, robot, number, settings.mass_scale)
    ]
    hulls = {number: _hulls(spec, body, robot, number, near) for number, body in enumerate(bodies)}
    _add_soles(robot, bodies)
    _add_contacts(spec, robot, hulls, settings.friction)
    model, overlapping = _compiled(spec, robot)
    of = {name: number for number, own in hulls.items() for name in own}
    of |= {_sole(leg): robot.slices[leg].stop for leg in robot.legs}
    joints = [model.joint(name) for name in robot.joint_names]
    return LeggedPhysics(
        model=model,
        joints=np.array([joint.qposadr[0] for joint in joints], np.int64),
        speeds=np.array([joint.dofadr[0] for joint in joints], np.int64),
        soles=np.array([model.geom(_sole(leg)).id for leg in robot.legs], np.int64),
        bodies=np.array([of.get(model.geom(i).name, -1) for i in range(model.ngeom)], np.int64),
        near=near,
        stiffness=stiffness,
        assumed=tuple(_assumed(robot, boxes, overlapping)),
    )


def _sole(leg: int) -> str:
    """Name of its geom, without a space: those of bodies' shapes have one."""
    return f"sole_{leg}"


def _bodies(spec: mujoco.MjSpec, robot: LeggedRobot, stiffness: Array) -> list[mujoco.MjsBody]:
    """The base, free in the air, and what each joint moves, in the robot's order."""
    # without names: what the description calls its links and joints may be taken ("world" is MuJoCo's own)
    bodies = [spec.worldbody.add_body()]
    bodies[0].add_freejoint()
    for leg in robot.legs:
        for number, joint in enumerate(range(robot.slices[leg].start, robot.slices[leg].stop)):
            carrier = bodies[robot.parents[1 + joint]]
            bodies.append(_moving(spec, carrier, robot, leg, number, float(stiffness[joint])))
    return bodies


def _add_rods(spec: mujoco.MjSpec, robot: LeggedRobot) -> None:
    """Joints that follow others are held to them."""
    names, coupling = robot.joint_names, robot.coupling
    for joint in np.flatnonzero(~coupling.free).tolist():
        rod = spec.add_equality(name1=names[joint], name2=names[coupling.leads[joint]], type=mujoco.mjtEq.mjEQ_JOINT)
        rod.objtype = mujoco.mjtObj.mjOBJ_JOINT
        rod.data[:2], rod.solref = (coupling.offsets[joint], coupling.ratios[joint]), SOLREF


def _add_soles(robot: LeggedRobot, bodies: list[mujoco.MjsBody]) -> None:
    for leg in robot.legs:
        frame = robot.pin_model.frames[robot.foot_frames[leg]]
        bodies[robot.slices[leg].stop].add_geom(
            name=_sole(leg),
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=(max(float(robot.radii[leg]), LEAST_RADIUS), 0.0, 0.0),
            pos=frame.placement.translation,
            contype=0,
            conaffinity=1,
        )


def _add_contacts(spec: mujoco.MjSpec, robot: LeggedRobot, hulls: dict[int, list[str]], friction: float) -> None:
    """Bodies that the planner keeps apart meet, and all meet the ground. hulls: body → its geoms."""
    for a, b in at_ease(robot).apart.pairs:
        for one in hulls[int(a)]:
            for other in hulls[int(b)]:
                spec.add_pair(geomname1=one, geomname2=other, condim=3)
    for geom in spec.geoms:
        geom.friction, geom.solref = (friction, 0.0, 0.0), SOLREF
    for pair in spec.pairs:
        pair.friction, pair.solref = (friction, friction, 0.0, 0.0, 0.0), SOLREF


def _compiled(spec: mujoco.MjSpec, robot: LeggedRobot) -> tuple[mujoco.MjModel, list[set[str]]]:
    """The model, without contacts of the pairs of hulls that overlap where the shapes don't, and those pairs."""
    model = spec.compile()
    overlapping = _overlapping(robot, model)
    if not overlapping:
        return model, []
    for pair in [one for one in spec.pairs if {one.geomname1, one.geomname2} in overlapping]:
        spec.delete(pair)
    return spec.compile(), overlapping


def assumed_stiffness(robot: LeggedRobot) -> Array:
    """What is taken for the stiffness of joints, (joints,) [N·m/rad or N/m], where nobody says it.

    Limits of effort that no leg needs, or that are not said, tell nothing of a motor's gains.
    """
    slides = np.concatenate([solver.limb.slides for solver in robot.limbs])
    weight = robot.mass * GRAVITY * np.where(slides, 1.0, robot.length)
    return np.minimum(robot.efforts, weight) / np.where(slides, SERVO_GIVE_SLIDE, SERVO_GIVE)


def _stiffness(robot: LeggedRobot, settings: PhysicsSettings) -> Array:
    """Of each joint in physics, as said or else assumed."""
    said = np.isfinite(robot.stiffness)
    return settings.stiffness_scale * np.where(said, robot.stiffness, assumed_stiffness(robot))


def _overlapping(robot: LeggedRobot, model: mujoco.MjModel) -> list[set[str]]:
    """Hulls that meet in the stance at ease, where the shapes themselves don't: two names of geoms each."""
    data = mujoco.MjData(model)
    data.qpos[2] = _FAR_UP
    data.qpos[[model.joint(name).qposadr[0] for name in robot.joint_names]] = at_ease(robot).q
    mujoco.mj_forward(model, data)
    return [{model.geom(int(geom)).name for geom in pair} for pair in data.contact.geom]


def _assumed(robot: LeggedRobot, boxes: list[str], overlapping: list[set[str]]) -> list[str]:
    said = [
        f"joints are damped: {DAMPING_TIME:g} s times their stiffness"
        if robot.sags
        else f"a joint gives {SERVO_GIVE:g} rad (one that slides {1000 * SERVO_GIVE_SLIDE:g} mm) at its whole effort, "
        f"or under the whole weight at the longest leg where that is less, with {DAMPING_TIME:g} s of damping",
        f"motor and gear add inertia: {ARMATURE_TIME:g} s squared times the joint's stiffness",
        "convex hulls stand for shapes",
    ]
    if robot.coupling.couples:
        said.append("joints that follow others are held to them by stiff rods")
    if overlapping:
        pairs = sorted({" and ".join(sorted(pair)) for pair in overlapping})
        said.append(f"hulls that overlap where the shapes don't may pass through each other: {', '.join(pairs)}")
    if boxes:
        said.append(f"solid boxes around their shapes stand for the inertias of {', '.join(boxes)}")
    if any(leg.sole.kind == "wheel" for leg in robot.model.legs):
        said.append("balls stand for discs that feet are, as in the planner")
    if any(leg.sole.radius < LEAST_RADIUS for leg in robot.model.legs):
        said.append(f"balls of {1000 * LEAST_RADIUS:g} mm stand for points that feet are")
    return said


def _moving(
    spec: mujoco.MjSpec, carrier: mujoco.MjsBody, robot: LeggedRobot, leg: int, number: int, k: float
) -> mujoco.MjsBody:
    """What a leg's joint moves, under a position servo that damps too."""
    joint, limb = robot.slices[leg].start + number, robot.limbs[leg].limb
    T, name = robot.pin_model.jointPlacements[1 + joint], robot.joint_names[joint]
    body = carrier.add_body(pos=T.translation, quat=quat_wxyz(T.rotation))
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE if limb.slides[number] else mujoco.mjtJoint.mjJNT_HINGE,
        axis=limb.axes[number],
        armature=ARMATURE_TIME**2 * k if robot.coupling.free[joint] else 0.0,
    )
    # the motor of a joint that follows another is its leader's
    own = k if robot.coupling.free[joint] else 0.0
    servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(kp=own, kv=DAMPING_TIME * own)
    return body


def _set_mass(body: mujoco.MjsBody, robot: LeggedRobot, number: int, scale: float) -> bool:
    """Whether the description's inertia can be simulated; else the mass lies as in a solid box around the shapes."""
    mass, center, inertia = joined_inertia(robot.members[number])
    if mass >= LEAST_MASS and inertia_fault(mass, inertia) is None:
        a, b, c = np.linalg.eigvalsh(inertia)
        if c <= a + b:
            set_inertial(body, mass, center, inertia, scale)
            return True
    corners, mass = robot.corners[number], max(mass, LEAST_MASS)
    x, y, z = np.maximum(np.ptp(corners, axis=0) if len(corners) else np.zeros(3), LEAST_SIZE) ** 2
    set_inertial(body, mass, center, mass / 12 * np.diag([y + z, z + x, x + y]), scale)
    return False


def _hulls(spec: mujoco.MjSpec, body: mujoco.MjsBody, robot: LeggedRobot, number: int, near: Array) -> list[str]:
    """Names of the body's geoms: the hull of each of its shapes, but of those that lie where the foot stands."""
    soles = [
        (robot.pin_model.frames[robot.foot_frames[leg]].placement.translation, near[leg])
        for leg in robot.legs
        if robot.slices[leg].stop == number
    ]
    named = []
    for k, shape in enumerate(robot.shapes[number]):
        points = np.asarray(shape.vertices, float)
        if any(np.linalg.norm(points - center, axis=1).max() <= reach for center, reach in soles):
            continue
        name = f"{robot.body_names[number]} {k}"
        try:
            corners = points[ConvexHull(points).vertices]
        except QhullError as err:
            raise InvalidRobot(f"{robot.body_names[number]}: its shape {k} is flat; physics needs a solid one") from err
        mesh = spec.add_mesh(name=name, uservert=corners.ravel())
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=0, conaffinity=1)
        named.append(name)
    return named
