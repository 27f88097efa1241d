"""What shows the ground that a rover hides from its own cameras: shifts and turns of the chassis, or a lifted leg.

``python -m benchmarks.looking --terrains 3`` makes a map of images on each ground, takes what stays unknown within half
a metre of a wheel, and asks from where that is in view.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import footfall
from benchmarks.scenes import robot
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.shift import shifted_state
from footfall.planning.looking.how_to_see import LIFTED, unknown_around
from footfall.planning.looking.in_view import in_view
from footfall.planning.scene.lift import vertical
from footfall.robot.kinematics import wheel_centers
from footfall.sim.render import render_snapshot
from footfall.telemetry.state import RobotState
from footfall.terrain.build import build_terrain
from footfall.terrain.dem import Dem
from footfall.terrain.generate import rock_field

AROUND = 0.5
"""Unknown ground within this of a wheel counts [m]."""
LOWERED = -0.2
"""As far as the chassis goes down with every shift, or legs are too short for it [m]."""


def shifts() -> Iterator[BodyShift]:
    """Of the chassis: to eight sides, turned, and leaning."""
    for distance in (0.15, 0.3):
        for angle in np.pi / 4 * np.arange(8):
            yield BodyShift(float(distance * np.cos(angle)), float(distance * np.sin(angle)), LOWERED)
    for turn in (-0.3, -0.15, 0.15, 0.3):
        yield BodyShift(dz=LOWERED, dyaw=turn)
    for tilt in (-0.15, 0.15):
        yield BodyShift(dz=LOWERED, droll=tilt)
        yield BodyShift(dz=LOWERED, dpitch=tilt)


def hidden(dem: Dem, state: RobotState) -> list[Array]:
    """Of each leg, the unknown ground around its wheel that is not in view."""
    wheels = apply(state.T_site_base, wheel_centers(robot(), state.posture))
    around = [unknown_around(dem, wheel[:2], AROUND) for wheel in wheels]
    return [points[~in_view(robot(), dem, state, points)] for points in around]


def best_shift(dem: Dem, state: RobotState, points: list[Array]) -> list[float]:
    """Of each leg, the largest share of its hidden ground (legs of n, 3) that any one shift brings into view."""
    there = [shifted_state(robot(), dem, state, shift) for shift in shifts()]
    stood = [one for one in there if isinstance(one, RobotState)]
    return [max(in_view(robot(), dem, one, own).mean() for one in stood) for own in points]


def lifted(dem: Dem, state: RobotState, points: list[Array]) -> list[float]:
    """Of each leg, the share of its hidden ground that is in view with that leg lifted."""
    shares = []
    for leg, own in enumerate(points):
        posture = np.array(state.posture)
        up = vertical(robot(), leg, state.T_site_base, posture[6 * leg : 6 * leg + 6], LIFTED)
        if not isinstance(up, str):
            posture[6 * leg : 6 * leg + 6] = up[-1]
            shares.append(float(in_view(robot(), dem, replace(state, posture=posture), own).mean()))
    return shares


def main() -> None:
    """Print the medians and the extremes over the legs of all grounds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--terrains", type=int, default=3)
    count, by_shift, by_lift = [], [], []
    for seed in range(parser.parse_args().terrains):
        truth = rock_field(size=12.0, resolution=0.04, abundance=0.03, smallest=0.1, largest=0.4, seed=seed)
        state = footfall.stand(robot(), truth, 0.0, 0.0, 0.0)
        dem = build_terrain(robot(), render_snapshot(robot(), state, truth, seed=seed))
        points = hidden(dem, state)
        count += [len(own) for own in points]
        by_shift += best_shift(dem, state, points)
        by_lift += lifted(dem, state, points)
        print(f"ground {seed}: {len(points)} legs looked at", flush=True)
    print(f"hidden places around a wheel, of {len(count)} wheels: median {np.median(count):.0f}")
    for name, shares in (("best shift or turn of the chassis", by_shift), (f"leg lifted by {LIFTED:g} m", by_lift)):
        print(f"in view by the {name}: median {np.median(shares):.0%}, {min(shares):.0%} to {max(shares):.0%}")


if __name__ == "__main__":
    main()
