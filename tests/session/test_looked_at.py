"""Which ground a product looked at is bounded from outside: what a leg touches is always within it."""

from types import SimpleNamespace

import numpy as np
import pytest

from footfall.core.frames import apply
from footfall.core.value import Provenance
from footfall.maps.layers import MapSettings, MapStack
from footfall.robot.kinematics import leg_link_poses, wheel_centers
from footfall.session.products.kinds import KINDS, MAPS, PLAN, WALK
from footfall.session.products.looked_at import discs_of, other_ground, spoiled
from footfall.terrain.ground.changed import ground_change
from tests.support.chassis_ground import wavy

LEG = 2
SEED = 20481


@pytest.fixture(scope="module")
def ground():
    return wavy(half=5.0)


def maps_of(dem):
    layers = {"footing": np.zeros(dem.geometry.shape, np.uint8)}
    return MapStack(dem.geometry, LEG, "plain", layers, Provenance({}, MapSettings()))


def raised(dem, x, y, z):
    """The ground with one cell at another height."""
    heights = dem.heights.copy()
    row, col = dem.geometry.cell(x, y)
    heights[row, col] = z
    change = ground_change(dem, type(dem)(heights, dem.geometry, dem.name, dem.provenance))
    assert change is not None
    return change


def postures(robot, dem, standing, count):
    """Postures (6,) of the leg that put its wheel's centre over the map, and points (k, 3) along it, site [m]."""
    rng = np.random.default_rng(SEED)
    limits = np.array([robot.model.lowerPositionLimit, robot.model.upperPositionLimit])[:, 6 * LEG : 6 * LEG + 6]
    while count:
        q = rng.uniform(*np.clip(limits, -np.pi, np.pi))
        posture = standing.posture.copy()
        posture[6 * LEG : 6 * LEG + 6] = q
        joints = np.array([T[:3, 3] for T in leg_link_poses(robot, q, LEG).values()])
        wheel = wheel_centers(robot, posture)[LEG]
        along = np.vstack([joints, wheel])
        share = rng.random((len(along) - 1, 1))
        points = apply(standing.T_site_base, np.vstack([along[:-1] + share * np.diff(along, axis=0), wheel]))
        if dem.geometry.contains(*points[-1, :2]):
            yield points
            count -= 1


def test_whatever_ground_a_leg_meets_spoils_the_cell_that_its_wheel_is_over(athlete, ground, standing):
    marked = clear = 0
    for points in postures(athlete, ground, standing, 40):
        for x, y, z in points[:-1]:
            if not ground.geometry.contains(x, y):
                continue
            change = raised(ground, x, y, max(z, 0.2))
            found = spoiled(athlete, standing, maps_of(ground), change)
            assert found[ground.geometry.cell(*points[-1, :2])], (SEED, x, y, z)
            assert (change.within(discs_of(MAPS, athlete, standing, maps_of(ground))) == change.cells).all()
            marked, clear = marked + int(found.sum()), clear + int((~found).sum())
    assert marked > 0
    assert clear > 0


def test_a_far_corner_marks_what_is_about_it_and_no_more(athlete, ground, standing):
    change = raised(ground, 4.6, 4.6, 0.4)
    found = spoiled(athlete, standing, maps_of(ground), change)
    away = np.hypot(ground.geometry.xs - 4.6, (ground.geometry.ys - 4.6)[:, None])
    assert found[away <= MapSettings().window].all()
    assert not found[away > MapSettings().window + athlete.wheel_radius + 0.4].any()
    looked = change.within(discs_of(MAPS, athlete, standing, maps_of(ground)))
    assert not looked.any()
    told = other_ground(change, change.cells)
    assert told.area == pytest.approx(0.01 * change.cells.sum())
    assert told.by == pytest.approx(0.4, abs=0.02)


def test_ground_under_any_wheel_is_for_every_cell(athlete, ground, standing):
    for wheel in apply(standing.T_site_base, wheel_centers(athlete, standing.posture)):
        assert spoiled(athlete, standing, maps_of(ground), raised(ground, wheel[0], wheel[1], 0.3)).all()


def test_a_way_is_looked_at_all_along_and_what_was_not_found_everywhere(athlete, standing):
    Ts_site_base = np.repeat(np.eye(4)[None], 3, axis=0)
    Ts_site_base[:, 0, 3] = 0.0, 2.0, 2.5
    discs = discs_of(WALK, athlete, standing, SimpleNamespace(plan=SimpleNamespace(Ts_site_base=Ts_site_base)))
    assert discs is not None
    reach = discs[0, 2]
    for share in np.linspace(0.0, 2.5, 26):
        nearest = np.abs(discs[:, 0] - share).min()
        assert nearest + athlete.leg_length(LEG) < reach
    for kind in (PLAN, WALK):
        assert discs_of(kind, athlete, standing, SimpleNamespace(plan=None)) is None
    commands = [kind for kind in KINDS.values() if kind.is_commands]
    assert all(discs_of(kind, athlete, standing, None) is None for kind in commands)
