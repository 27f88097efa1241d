"""One problem of the set: who stands where on what ground, which leg is to step where. Small, frozen, made anew."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

import footfall
from benchmarks import scenes
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation, transform
from footfall.planning.answers import No
from footfall.planning.scene.ground import footfall_contact
from footfall.planning.step.target import candidates
from footfall.robot.description import with_payload
from footfall.robot.ik import contact_point
from footfall.robot.meshes.collision import CollisionScene
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import fractal, plane, rock_field, slope
from footfall.terrain.ground.triangulate import triangulate
from footfall.terrain.rocks import add_rocks

REAL_GROUND = Path(__file__).resolve().parents[3] / "shared" / "data"
"""Where real terrain is looked for; the problems on it are left out where the folder is absent."""
SIZE, RESOLUTION = 8.0, 0.03
"""Of made ground [m]."""


@dataclass(frozen=True)
class Ground:
    """kind: plane, slope, fractal, rocks, or the name of a file of real ground (REAL_FILES).

    amount: a slope's angle [rad], a fractal's roughness [m], the share that rocks cover. rocks: further ones, each
    (x, y, diameter, height) [m].
    """

    kind: str
    amount: float = 0.0
    seed: int = 0
    rocks: tuple[tuple[float, float, float, float], ...] = ()

    def make(self) -> Dem:
        bare = _bare(self.kind, self.amount, self.seed)
        return add_rocks(bare, self.rocks) if self.rocks else bare


@dataclass(frozen=True)
class Load:
    """A box on the chassis: mass [kg], size and centre in base [m]."""

    mass: float
    size: tuple[float, float, float]
    position: tuple[float, float, float]


@dataclass(frozen=True)
class StepProblem:
    """place: x, y [m] and heading [rad] of the chassis. turned: legs that stand elsewhere than the posture has them,
    each (leg, x, y). target: the footfall, site [m]."""

    family: str
    seed: int
    ground: Ground
    place: tuple[float, float, float]
    posture: str
    leg: int
    target: tuple[float, float]
    load: Load | None = None
    turned: tuple[tuple[int, float, float], ...] = ()

    @property
    def name(self) -> str:
        return f"{self.family} {self.seed}"


@dataclass(frozen=True)
class Scene:
    """What a problem is planned in."""

    robot: Robot
    dem: Dem
    state: RobotState


REAL_FILES = {
    "lunar picture": ("lunar_gld100_dtm2_2970.png", {"size": (18.0, 12.0), "height_range": (0.0, 0.5)}),
    "fractal mesh": ("fractal_terrain_1.off", {"scale": 2.75}),
}
"""File and how it is read: 8 bit of lunar terrain as 18 × 12 m (every third cell, 5 cm), and a mesh of 55 × 55 m."""


def is_here(problem: StepProblem) -> bool:
    """Whether the ground of the problem can be made on this machine."""
    return problem.ground.kind not in REAL_FILES or (REAL_GROUND / REAL_FILES[problem.ground.kind][0]).is_file()


def build(problem: StepProblem) -> Scene:
    """The scene of a problem. Raises InvalidInput where the rover can't stand so."""
    robot, dem = rover(problem.load), problem.ground.make()
    x, y, yaw = problem.place
    # where legs stand elsewhere than the posture has them, the load may be where they were
    state = footfall.stand(rover(None) if problem.turned else robot, dem, x, y, yaw, problem.posture)
    for leg, east, north in problem.turned:
        state = _with_leg_at(robot, dem, state, leg, east, north)
    return Scene(robot, dem, state)


@lru_cache(maxsize=8)
def rover(load: Load | None) -> Robot:
    if load is None:
        return scenes.robot()
    return Robot(with_payload(scenes.robot().description, load.mass, load.size, load.position))


def beside_hip(place: tuple[float, float, float], leg: int, radius: float, angle: float) -> tuple[float, float]:
    """Site (x, y) of a place ``radius`` [m] from a leg's hip, ``angle`` [rad] left of the leg's outward direction."""
    T_base_hip = scenes.robot().description.legs[leg].T_base_hip
    T_site_base = transform(rotation("z", place[2]), (place[0], place[1], 0.0))
    x, y, _ = apply(T_site_base @ T_base_hip, np.array([radius * np.cos(angle), radius * np.sin(angle), 0.0]))
    return float(x), float(y)


def standing_at(posture: str) -> np.ndarray:
    """Where the wheel of leg 0 touches level ground in a named posture, (3,) in base [m]."""
    robot = scenes.robot()
    return contact_point(robot, robot.posture(posture), 0, np.eye(4))


def wheel_radius_of(posture: str) -> float:
    """How far from its hip a wheel stands in a named posture, seen from above [m]."""
    return float(standing_at(posture)[0] - scenes.robot().description.legs[0].T_base_hip[0, 3])


def _with_leg_at(robot: Robot, dem: Dem, state: RobotState, leg: int, x: float, y: float) -> RobotState:
    """The state with one leg standing at (x, y), in the first posture there that nothing collides in."""
    contact = footfall_contact(robot, dem, x, y)
    if isinstance(contact, No):
        raise InvalidInput(f"leg {leg} can't be put to ({x:.2f}, {y:.2f}): {contact.reason}")
    T_site_base = np.asarray(state.T_site_base)
    scene = CollisionScene(robot, state.posture, leg, T_site_base, triangulate(dem))
    for one in candidates(robot, leg, contact, T_site_base, np.asarray(state.leg(leg)), 0):
        if not scene.collides(one.q, "true"):
            posture = np.array(state.posture)
            posture[6 * leg : 6 * leg + 6] = one.q
            return replace(state, posture=posture)
    raise InvalidInput(f"leg {leg} can't stand at ({x:.2f}, {y:.2f}) free of collisions")


@lru_cache(maxsize=4)
def _bare(kind: str, amount: float, seed: int) -> Dem:
    if kind == "plane":
        return plane(SIZE, RESOLUTION)
    if kind == "slope":
        return slope(SIZE, RESOLUTION, amount, uphill=float(seed))
    if kind == "fractal":
        return fractal(SIZE, RESOLUTION, amount, 0.8, seed)
    if kind == "rocks":
        return rock_field(SIZE, RESOLUTION, amount, largest=0.6, seed=seed)
    file, how = REAL_FILES[kind]
    whole = footfall.read_terrain(REAL_GROUND / file, center=True, **how)
    grid, every = whole.geometry, max(1, round(2 * RESOLUTION / whole.geometry.resolution))
    return from_heights(whole.heights[::every, ::every], every * grid.resolution, grid.x0, grid.y0, kind)
