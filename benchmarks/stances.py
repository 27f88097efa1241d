"""Random stances that the terrain figures are measured on: what the rover does, and what its encoders say it does.

Simulated: no figure of a real rover's compliance or encoders went in, only the sizes that the floors name.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import robot
from footfall.core.frames import apply, rotation, transform
from footfall.robot.ik import contact_point, leg_azimuth, solve_leg, wheel_pose_for_contact
from footfall.robot.kinematics import wheel_centers, wheel_jacobian, wheel_pose
from footfall.robot.meshes.collision import posture_collisions
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall.terrain.generate import fractal
from footfall.terrain.ground.surface import height_at, normal_at
from footfall.terrain.rocks import add_rocks

ENCODER_SD = np.deg2rad(0.5)
SAG = 0.03

ROCK_HEIGHT = 0.10
LIFTED = 0.25
"""Share of the stances in which one leg is in the air."""


@dataclass(frozen=True)
class RandomStance:
    """true: where the rover is; measured: the same with the joint angles that its encoders give.

    rocks: (n, 4) as x, y, diameter, height, one beside each wheel. lifted: the leg in the air, or None. ground: the
    world before it had the rocks.
    """

    ground: Dem
    world: Dem
    true: RobotState
    measured: RobotState
    rocks: NDArray[np.float64]
    lifted: int | None

    @property
    def wheels(self) -> NDArray[np.float64]:
        """True wheel centres, site, (legs, 3) [m]."""
        return apply(self.true.T_site_base, wheel_centers(robot(), self.true.posture))


def random_stance(
    seed: int, rock_diameter: float = 0.2, encoder_sd: float = ENCODER_SD, sag: float = SAG
) -> RandomStance:
    """Wheels at random places of rolling ground, chassis level at a random height, a rock beside each wheel."""
    rng = np.random.default_rng(seed)
    ground = fractal(size=12.0, resolution=0.02, roughness=0.05, hurst=0.9, seed=seed)
    yaw, lifted = rng.uniform(-np.pi, np.pi), int(rng.integers(6)) if rng.uniform() < LIFTED else None
    for _ in range(200):
        posture, T_site_base = _placed(ground, yaw, lifted, rng)
        if posture is not None and not posture_collisions(robot(), posture, T_site_base, None):
            break
    else:
        raise RuntimeError(f"no stance found with seed {seed}")
    rocks = _rocks_beside(posture, T_site_base, lifted, rock_diameter, rng)
    encoders = posture + rng.normal(0.0, encoder_sd, len(posture))
    for leg in robot().legs:
        if leg != lifted:
            encoders[6 * leg : 6 * leg + 6] -= deflection(posture, leg, sag)
    return RandomStance(
        ground, add_rocks(ground, rocks), _state(posture, T_site_base), _state(encoders, T_site_base), rocks, lifted
    )


def deflection(posture: NDArray[np.float64], leg: int, sag: float) -> NDArray[np.float64]:
    """Joint angles by which a vertical load bends one leg until its wheel is ``sag`` [m] nearer to the chassis, (6,).

    Springs in series bend in proportion to torque / stiffness: K⁻¹ Jᵀ f.
    """
    upwards = wheel_jacobian(robot(), posture, leg)[2]
    bent = upwards / robot().stiffness[6 * leg : 6 * leg + 6]
    return sag * bent / float(upwards @ bent)


def _placed(ground: Dem, yaw: float, lifted: int | None, rng: np.random.Generator):
    nominal = robot().posture("stand")
    T_site_ground = transform(rotation("z", yaw))
    wanted = np.array([contact_point(robot(), nominal, leg, T_site_ground) for leg in robot().legs])
    wanted[:, :2] += rng.uniform(-0.25, 0.25, (6, 2))
    heights = height_at(ground, wanted[:, 0], wanted[:, 1])
    normals = normal_at(ground, wanted[:, 0], wanted[:, 1], robot().wheel_radius)
    base_height = float(heights.mean() - wanted[:, 2].mean()) + rng.uniform(-0.25, 0.15)
    T_site_base = transform(rotation("z", yaw), (0.0, 0.0, base_height))
    posture = np.empty(36)
    for leg in robot().legs:
        rise = rng.uniform(0.1, 0.4) if leg == lifted else 0.0
        contact = np.array([*wanted[leg, :2], heights[leg] + rise])
        heading = leg_azimuth(robot(), leg, T_site_base) + rng.uniform(-0.4, 0.4)
        T = wheel_pose_for_contact(robot(), contact, normals[leg], heading, T_site_base)
        found = solve_leg(robot(), leg, T[None])
        if not found.valid[0].any():
            return None, T_site_base
        away = np.square(found.q[0] - nominal[6 * leg : 6 * leg + 6]).sum(axis=1)
        posture[6 * leg : 6 * leg + 6] = found.q[0, np.argmin(np.where(found.valid[0], away, np.inf))]
    return posture, T_site_base


def _rocks_beside(
    posture: NDArray, T_site_base: NDArray, lifted: int | None, diameter: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """One rock for each standing wheel, a wheel radius of free ground between them, on a random side of it."""
    r = robot()
    rocks = []
    for leg in r.legs:
        if leg == lifted:
            continue
        T = T_site_base @ wheel_pose(r, posture, leg)
        axle = T[:2, 1] / np.linalg.norm(T[:2, 1])
        rolling = np.array([-axle[1], axle[0]])
        half = np.array([r.wheel_radius, 0.5 * r.description.wheel_width])
        away = r.wheel_radius + 0.5 * diameter
        # a point of the rectangle under the wheel, seen from above, and straight or slantwise out of it
        angle = rng.uniform(-np.pi, np.pi)
        out = np.array([np.cos(angle), np.sin(angle)])
        corner = np.sign(out) * half
        local = corner + away * out
        x, y = T[:2, 3] + local[0] * rolling + local[1] * axle
        rocks.append((x, y, diameter, ROCK_HEIGHT))
    return np.array(rocks)


def _state(posture: NDArray, T_site_base: NDArray) -> RobotState:
    return RobotState(robot().name, 0.0, posture, T_site_base, np.zeros((6, 3)), np.zeros(36), "idle")
