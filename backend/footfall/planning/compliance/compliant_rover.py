"""The rover as it gives way: joints and wheels are springs, wheels touch the ground by pushing only.

A joint is a spring between its set point (``commanded``) and where it is; its torque is stiffness × (commanded −
posture). A wheel's rim is a ball that the ground holds; its hub moves against the rim on a spring that is as stiff
sideways as upwards. A locked wheel rolls over its rim as its leg turns. The force is −k_w · strain while the wheel is
pressed down, its tangential part no more than friction allows; what is beyond has slipped, for good. So strain is
carried along: where the rover stands depends on how it got there, and each equilibrium starts from the one before.

Motions are slow (about 0.1 rad/s), so nothing here has inertia. Joints don't end at their limits here.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.balance.payload import carried
from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import require_transform, transform
from footfall.maps.standing import STANDING_GAP, contacts
from footfall.planning.compliance.ball_contact import ball_contacts
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.equilibrium_kernel import BALANCED, Body, Pose, settle
from footfall.robot.kinematics import leg_wheel_pose
from footfall.robot.leg_frames import leg_lengths
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import height_at

INCREMENT = 0.01
"""Largest change of a set point in one increment of the load [rad]: about 1 cm at a wheel."""
NO_GROUND = -1e3
"""Height of the ground where none is known [m]: nothing there bears a wheel."""


@dataclass(frozen=True, eq=False)
class RestingRover:
    """The rover in equilibrium, with all that its future depends on.

    commanded, posture: (legs × 6,) set points and angles [rad]; T_site_base: (4, 4). forces: of the ground on the
    wheels, site, (legs, 3) [N]; torques: of the joints, (legs × 6,) [N·m]. hubs: wheel centres, site, (legs, 3) [m];
    turns: (legs, 3, 3), R_site_wheel. points, normals: (legs, 3), plane of the ground at each wheel. rims: (legs, 3),
    where the ground holds the middles of the rims. bias: (legs × 6,) [rad], on top of what is commanded while the leg's
    wheel touches; offset: the same, wherever the wheel is; stiffness: (legs × 6,) of the joints [N·m/rad]. raised:
    (legs,), how much higher the ground is at each wheel than on the map, along its normal [m]. by_force: (legs,),
    whether the normal at a wheel is not the map's, but told by the force that holds it there, as long as it stands.
    left_over: largest force or moment out of balance [N, N·m].
    """

    commanded: Array
    posture: Array
    T_site_base: Array
    forces: Array
    torques: Array
    hubs: Array
    turns: Array
    points: Array
    normals: Array
    rims: Array
    bias: Array
    offset: Array
    stiffness: Array
    raised: Array
    by_force: NDArray[np.bool_]
    left_over: float

    @property
    def settled(self) -> bool:
        """Whether it is an equilibrium; else none was found: the rover tips over, slides or sits down."""
        return self.left_over <= BALANCED

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Which wheels are pressed down, (legs,)."""
        return (self.forces != 0.0).any(axis=1)

    @property
    def loads(self) -> Array:
        """Force along the ground's normal at each wheel, (legs,) [N]."""
        return np.sum(self.forces * self.normals, axis=1)

    @property
    def contacts(self) -> Array:
        """Where each wheel touches its plane, or would if it came straight down to it, site, (legs, 3) [m]."""
        above = np.sum((self.rims - self.points) * self.normals, axis=1, keepdims=True)
        return self.rims - above * self.normals


class CompliantRover:
    """A robot of springs on a ground.

    unseen: (rows, cols), cells of ``dem`` that nobody saw: filled to the height of the wheels that stand there, they
    don't tell how high the ground is; None: all were seen.
    """

    def __init__(
        self,
        robot: Robot,
        dem: Dem,
        settings: ComplianceSettings | None = None,
        unseen: NDArray[np.bool_] | None = None,
    ) -> None:
        self.robot, self.dem, self.unseen = robot, dem, unseen
        self.settings = settings or ComplianceSettings()
        balance = self.settings.balance
        self.stiffness = self.settings.joint_scale * robot.stiffness
        self.wheel_stiffness = self.settings.wheel_scale * robot.description.wheel_stiffness
        self.gravity = np.array(-balance.gravity * balance.R_level_site[2])
        self.body = _body(robot, self.settings, self.stiffness, self.wheel_stiffness)
        self.mass = self.body.chassis_mass + float(self.body.masses.sum())

    def let_down(self, commanded: ArrayLike, T_site_base: ArrayLike) -> RestingRover:
        """How the rover comes to rest that stands weightless, its joints at ``commanded`` (legs × 6,), and is let go.

        Wheels within STANDING_GAP of the ground, or over ground that nobody saw, touch it where they are. Raises
        InvalidInput where fewer than three do.
        """
        q, T = self.robot.require_posture(commanded), np.array(require_transform(T_site_base, "T_site_base"))
        hubs, turns = self.wheels(q, T)
        below, normals, seen = self.ground_under(q, T)
        above = np.sum((hubs - below) * normals, axis=1) - self.robot.wheel_radius
        touching = ~seen | (above <= STANDING_GAP)
        require_three(touching)
        points = np.where(touching[:, None], hubs - self.robot.wheel_radius * normals, below)
        # it begins pressed down by its weight, so that no wheel is about to lift off or slip
        pressed = self.mass * self.gravity / (touching.sum() * self.wheel_stiffness)
        T[:3, 3] += pressed
        pose = Pose(
            T[:3, :3].copy(), T[:3, 3].copy(), np.array(q), touching, hubs + pressed, turns, points, normals, 0.0 * hubs
        )
        raised = np.where(seen, np.sum((points - below) * normals, axis=1), 0.0)
        by_force = np.zeros(len(touching), dtype=bool)
        return self.settle(pose, q, q, np.zeros_like(q), np.zeros_like(q), self.stiffness, raised, by_force, 1)

    def after(self, rest: RestingRover, commanded: ArrayLike) -> RestingRover:
        """The equilibrium after the set points went straight to ``commanded`` (legs × 6,).

        The ground under each wheel is taken where that wheel is before: ask for a few centimetres at a time.
        Where there is no equilibrium the result is not ``settled``.
        """
        target = self.robot.require_posture(commanded)
        increments = max(1, int(np.ceil(np.abs(target - rest.commanded).max() / INCREMENT)))
        touching, T = rest.touching, rest.T_site_base
        below, normals, seen = self.ground_under(rest.posture, T, forces=rest.forces)
        # where the wheels that stand find the ground on the whole, so will the next one
        raised = np.where(touching, rest.raised, self.found_higher(rest))
        kept = touching & (~seen | rest.by_force)
        normals = np.where(kept[:, None], rest.normals, normals)
        points = np.where(kept[:, None], rest.points, below + raised[:, None] * normals)
        pose = Pose(
            T[:3, :3].copy(),
            T[:3, 3].copy(),
            rest.posture.copy(),
            touching,
            rest.rims.copy(),
            rest.turns.copy(),
            points,
            normals,
            rest.forces.copy(),
        )
        by_force = touching & rest.by_force
        return self.settle(
            pose, rest.commanded, target, rest.bias, rest.offset, rest.stiffness, raised, by_force, increments
        )

    def found_higher(self, rest: RestingRover) -> float:
        """How much higher than on the map the wheels that touch find the ground [m], by their median.

        0 where none stands on ground that was seen.
        """
        seen = [leg for leg in np.flatnonzero(rest.touching) if self._seen_at(rest.contacts[leg])]
        return float(np.median(rest.raised[seen])) if seen else 0.0

    def _seen_at(self, point: Array) -> bool:
        """Whether the height at a point (3,) is the map's, not made up."""
        if self.unseen is None:
            return True
        grid = self.dem.geometry
        # a height is that between the middles of four cells
        col, row = np.floor((point[:2] - (grid.x0, grid.y0)) / grid.resolution).astype(int).tolist()
        around = self.unseen[max(row, 0) : row + 2, max(col, 0) : col + 2]
        return around.size > 0 and not around.any()

    def seen_under(self, hub: Array) -> bool:
        """Whether all of the ground below a wheel with its middle there (3,) was seen, as far out as its rim."""
        if self.unseen is None:
            return True
        grid = self.dem.geometry
        col, row = (hub[:2] - (grid.x0, grid.y0)) / grid.resolution
        reach = self.robot.wheel_radius / grid.resolution
        rows = slice(max(int(np.floor(row - reach)), 0), int(np.ceil(row + reach)) + 1)
        cols = slice(max(int(np.floor(col - reach)), 0), int(np.ceil(col + reach)) + 1)
        return not self.unseen[rows, cols].any()

    def settle(
        self,
        pose: Pose,
        before: Array,
        commanded: Array,
        bias: Array,
        offset: Array,
        stiffness: Array,
        raised: Array,
        by_force: NDArray[np.bool_],
        increments: int,
    ) -> RestingRover:
        """The equilibrium that ``pose``, one with the set points ``before``, goes to with ``commanded``.

        bias: on top of both, of legs whose wheels touch: what their deflection is more than explained comes from where
        and how the ground pushes on the wheel. offset, stiffness, raised, by_force: see :class:`RestingRover`. pose is
        changed. All set points and angles are (legs × 6,) [rad], raised and by_force are (legs,) [m].
        """
        borne = offset + np.where(np.repeat(pose.touching, 6), bias, 0.0)
        target = commanded + borne
        body = self.body._replace(stiffness=stiffness)
        left_over = settle(body, pose, before + borne, target, self.gravity, increments)
        T = transform(pose.R, pose.t)
        hubs, turns = self.wheels(pose.q, T)
        return RestingRover(
            commanded=np.array(commanded),
            posture=pose.q,
            T_site_base=T,
            forces=pose.forces,
            torques=stiffness * (target - pose.q),
            hubs=hubs,
            turns=turns,
            points=pose.points,
            normals=pose.normals,
            rims=pose.rims,
            bias=bias,
            offset=offset,
            stiffness=stiffness,
            raised=raised,
            by_force=by_force,
            left_over=float(left_over),
        )

    def wheels(self, posture: Array, T_site_base: Array) -> tuple[Array, Array]:
        """Hubs (legs, 3) [m] and R_site_wheel (legs, 3, 3), in site."""
        legs = self.robot.legs
        Ts = T_site_base @ np.array([leg_wheel_pose(self.robot, posture[6 * i : 6 * i + 6], i) for i in legs])
        return Ts[:, :3, 3].copy(), Ts[:, :3, :3].copy()

    def gaps(self, rest: RestingRover) -> Array:
        """How far each rim is from its ground along the normal, (legs,) [m]; negative: pressed in."""
        return np.sum((rest.hubs - rest.points) * rest.normals, axis=1) - self.robot.wheel_radius

    def ground_under(
        self, posture: Array, T_site_base: Array, legs: ArrayLike | None = None, forces: Array | None = None
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Points (k, 3) on the ground where wheels meet it, its normals (k, 3) there, and whether it is known, (k,).

        forces: of the ground on all wheels, site, (legs, 3) [N]: rims are shifted by them; None: none. Where the ground
        below a wheel's middle is not known: under its lowest point, on the plane of what is around.
        """
        chosen = self.robot.legs if legs is None else [int(leg) for leg in np.asarray(legs)]
        rims, _ = self.wheels(posture, T_site_base)
        rims = rims if forces is None else rims + forces / self.wheel_stiffness
        points, normals, seen = ball_contacts(self.dem, rims[chosen], self.robot.wheel_radius)
        if not seen.all():
            around = contacts(self.robot, self.dem, posture, T_site_base, chosen)
            heights = height_at(self.dem, around.points[:, 0], around.points[:, 1])
            points[~seen], normals[~seen] = around.points[~seen], around.normals[~seen]
            points[~seen, 2] = np.where(np.isfinite(heights), heights, NO_GROUND)[~seen]
            seen = seen | np.isfinite(heights)
        return points, normals, seen

    def state(self, rest: RestingRover, time: float = 0.0) -> RobotState:
        """What the telemetry of a rover at rest says."""
        return RobotState(self.robot.name, time, rest.posture, rest.T_site_base, rest.forces, rest.torques, "idle")


def require_three(touching: NDArray[np.bool_]) -> None:
    """Raises InvalidInput unless three wheels touch the ground. touching: (legs,)."""
    if touching.sum() < 3:
        legs = ", ".join(str(leg) for leg in np.flatnonzero(touching)) or "none"
        raise InvalidInput(
            f"the wheels of three legs must be pressed on the ground for the rover to stand; here: {legs}",
            touching=np.flatnonzero(touching).tolist(),
        )


def _body(robot: Robot, settings: ComplianceSettings, stiffness: Array, wheel_stiffness: float) -> Body:
    description, balance = robot.description, settings.balance
    inertias = list(robot.model.inertias)
    mass, moment = inertias[0].mass, inertias[0].mass * inertias[0].lever
    load = carried(robot, balance)
    if load is not None:
        mass, moment = mass + load[0], moment + load[0] * load[1]
    links = inertias[1:]
    return Body(
        lengths=np.array([leg_lengths(leg) for leg in description.legs]),
        hips=np.array([leg.T_base_hip for leg in description.legs]),
        masses=np.array([link.mass for link in links]).reshape(-1, 6),
        levers=np.array([link.lever for link in links]).reshape(-1, 6, 3),
        chassis_mass=float(mass),
        chassis_center=np.array(moment / mass),
        stiffness=np.array(stiffness),
        wheel_stiffness=float(wheel_stiffness),
        radius=float(robot.wheel_radius),
        rolled=float(robot.wheel_radius) if settings.rolling else 0.0,
        friction=float(balance.friction),
    )
