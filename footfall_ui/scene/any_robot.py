"""What drawings ask of a robot, whoever described it: its class is told apart here alone.

A robot that others described is drawn as what the planner checks, its collision shapes; a body without any is not
there to be seen.
"""

from collections.abc import Collection, Mapping
from typing import Protocol, TypeAlias

import numpy as np
import viser
from numpy.typing import ArrayLike

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.payload import loaded
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.mesh import Mesh
from footfall.maps.support_outlines import Support, support_of
from footfall.planning.legged.held_by_feet import held_by_feet
from footfall.robot.foot_centers import soles
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass, link_poses
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall_ui.scene.legged_robot import LeggedDrawing, bodies_of, body_mesh
from footfall_ui.scene.painted import Color
from footfall_ui.scene.robot import RobotDrawing, leg_links

AnyRobot: TypeAlias = Robot | LeggedRobot

REACH, MASS = 3.56, 850.0
"""Of ATHLETE, for which the sizes of drawings are chosen: from the middle of the chassis to a stretched leg's contact
[m]; in all [kg]."""
SMALLEST = 0.03
"""Radius of what is drawn of a foot that is a point, as a share of the robot's reach."""


class DrawnRobot(Protocol):
    """A robot in the scene, or a see-through copy of it or of one leg."""

    def place(self, posture: Array, T_site_base: Array) -> None:
        """Show it in a posture (joints,) [rad or m] and at a pose of the base."""

    def highlight(self, chosen: Collection[str], colliding: Collection[str] = ()) -> None:
        """Colour the chosen parts apart from the rest, and those that would collide apart from both."""

    def hide(self) -> None: ...

    def remove(self) -> None: ...


def drawn_robot(
    server: viser.ViserServer | viser.ClientHandle,
    robot: AnyRobot,
    name: str = "rover",
    leg: int | None = None,
    color: Color | None = None,
    opacity: float | None = None,
) -> DrawnRobot:
    """Draw a robot, or one leg of it, under ``/<name>``; hidden until it is placed."""
    if isinstance(robot, LeggedRobot):
        return LeggedDrawing(server, robot, name, leg, color, opacity)
    return RobotDrawing(server, robot, name, None if leg is None else leg_links(robot, leg), color, opacity)


def leg_parts(robot: AnyRobot, leg: int) -> set[str]:
    """Names of the parts of one leg."""
    return {str(body) for body in bodies_of(robot, leg)} if isinstance(robot, LeggedRobot) else leg_links(robot, leg)


def sole_radius(robot: AnyRobot, leg: int) -> float:
    """Of what is drawn where a foot stands, or is to stand [m]."""
    if isinstance(robot, LeggedRobot):
        return max(float(robot.radii[leg]), SMALLEST * reach(robot))
    return robot.wheel_radius


def lowest(robot: AnyRobot, posture: ArrayLike, leg: int, T_site_base: Array) -> Array:
    """Where a foot touches level ground, site (3,) [m]."""
    if isinstance(robot, LeggedRobot):
        return apply(T_site_base, soles(robot, posture)[leg]) - [0.0, 0.0, robot.radii[leg]]
    return contact_point(robot, posture, leg, T_site_base)


def mass_center(robot: AnyRobot, posture: ArrayLike, balance: BalanceSettings | None = None) -> Array:
    """Of the whole robot, in base (3,) [m]; balance: whose payload it carries instead of its own."""
    if isinstance(robot, LeggedRobot):
        return placed(robot, posture).com
    own = center_of_mass(robot, posture)
    return own if balance is None else loaded(robot, own, balance)[1]


def hip(robot: AnyRobot, posture: ArrayLike, leg: int) -> Array:
    """Where a leg begins, in base (3,) [m]."""
    if isinstance(robot, LeggedRobot):
        return placed(robot, posture).Ts_base_body[1 + robot.slices[leg].start, :3, 3]
    return robot.description.legs[leg].T_base_hip[:3, 3]


def outward(robot: AnyRobot, leg: int, posture: ArrayLike | None = None) -> Array:
    """The way that a leg goes out, in base, (3,) of length 1 and level there.

    posture: of robots that others described, whose hips say nothing of it; None: the one in the middle of the limits.
    """
    if not isinstance(robot, LeggedRobot):
        return robot.description.legs[leg].T_base_hip[:3, 0]
    there = soles(robot, 0.5 * (robot.lower + robot.upper) if posture is None else posture)[leg] * [1.0, 1.0, 0.0]
    away = float(np.linalg.norm(there))
    return there / away if away > 0 else np.array([1.0, 0.0, 0.0])


def reach(robot: AnyRobot) -> float:
    """From the middle of the base to the contact of its longest leg, stretched level [m]."""
    if not isinstance(robot, LeggedRobot):
        hips = [leg.T_base_hip for leg in robot.description.legs]
        return max(float(np.hypot(*T[:2, 3])) + robot.leg_length(leg) for leg, T in enumerate(hips))
    middle = placed(robot, 0.5 * (robot.lower + robot.upper)).Ts_base_body
    return max(float(np.hypot(*middle[1 + own.start, :2, 3])) for own in robot.slices) + robot.length


def chassis_width(robot: AnyRobot) -> float:
    """Of what of it is seen, the larger of length and breadth [m]; of a base without a shape, between its hips."""
    if not isinstance(robot, LeggedRobot):
        seen = robot.description.meshes["base"].vertices
    elif len(robot.corners[0]):
        seen = robot.corners[0]
    else:
        seen = np.array([hip(robot, 0.5 * (robot.lower + robot.upper), leg) for leg in robot.legs])
    return float(np.ptp(seen[:, :2], axis=0).max())


def size(robot: AnyRobot) -> float:
    """How large drawings are beside those of ATHLETE, as whose they are chosen: 1 for robots of its build."""
    return reach(robot) / REACH if isinstance(robot, LeggedRobot) else 1.0


def heft(robot: AnyRobot) -> float:
    """How large forces are beside those of ATHLETE: 1 for robots of its build."""
    return robot.mass / MASS if isinstance(robot, LeggedRobot) else 1.0


def leg_name(robot: AnyRobot, leg: int) -> str:
    """What a leg is called in labels."""
    return f"leg {robot.leg_names[leg] if isinstance(robot, LeggedRobot) else leg}"


def feet(robot: AnyRobot) -> str:
    """What is at the ends of its legs, in words."""
    return "feet" if isinstance(robot, LeggedRobot) else "wheels"


def part_meshes(robot: AnyRobot, leg: int | None = None) -> Mapping[str, Mesh]:
    """The shapes of the parts of one leg, or of all parts, by a name that viser takes; each in its own frame."""
    if not isinstance(robot, LeggedRobot):
        links = robot.description.meshes
        return links if leg is None else {link: links[link] for link in leg_links(robot, leg)}
    own = range(len(robot.shapes)) if leg is None else bodies_of(robot, leg)
    return {str(body): body_mesh(robot, body) for body in own if robot.shapes[body]}


def Ts_base_part(robot: AnyRobot, posture: ArrayLike) -> Mapping[str, Array]:
    """Where the parts are, by the names of :func:`part_meshes`, (4, 4) each."""
    if isinstance(robot, LeggedRobot):
        return {str(body): T for body, T in enumerate(placed(robot, posture).Ts_base_body)}
    return link_poses(robot, np.asarray(posture, float))


def held(
    robot: AnyRobot, dem: Dem | None, state: RobotState, legs: list[int], balance: BalanceSettings | None = None
) -> Support:
    """What the feet of some legs hold, as :func:`.support_of` says."""
    if isinstance(robot, LeggedRobot):
        return held_by_feet(robot, dem, state, legs, balance)
    return support_of(robot, dem, state.posture, state.T_site_base, legs, balance)
