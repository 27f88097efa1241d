"""What is asked of a rover on a tether beside its way: any foot lost, and samples as near as turned ground wants."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.balance.held import held_tables
from footfall.balance.tether import Tether
from footfall.core.frames import apply, transform
from footfall.planning.scene.ground import Nearby
from footfall.planning.walk.body_kernel import torque_of
from footfall.planning.walk.hung import Hung
from footfall.planning.walk.problem import WalkSettings
from footfall.planning.walk.slope_frame import SlopeFrame
from footfall.planning.walk.transition_kernel import REQUIRED, Balance
from footfall.planning.walk.world import LEAST_GAP, World
from footfall.robot.kinematics import center_of_mass
from footfall.terrain.ground.unseen import without_holes_between
from tests.balance.test_held import least_held_ratio, placed
from tests.balance.test_tether import SETTINGS, hanging, slack
from tests.support.chassis_ground import wavy
from tests.support.kept_arrays import read_only


def test_required_support_counts_on_no_more_than_the_drum_can(athlete, rng):
    """Without any one foot some forces hold it with a pull that the drum has, however strong the motors are."""
    whole = without_holes_between(wavy(), np.full(2, -2.0), np.full(2, 2.0), np.empty((0, 3)))
    assert whole is not None
    world = World(athlete, Nearby(whole.dem, whole.filled), WalkSettings(), transform(translation=(0.0, 0.0, 1.5)))
    checks = world.first.checks._replace(most_torque=1.0, balance=Balance(REQUIRED, 0.0))
    weight, legs, seen = athlete.mass * SETTINGS.gravity, np.arange(6), set()
    for q, T, _, normals, tether in zip(*hanging(athlete, rng, 60, 75.0), strict=True):
        unit, every = read_only(normals / np.linalg.norm(normals, axis=1, keepdims=True)), np.ones(6, bool)
        poses, _, contacts, *_ = placed(athlete, q, T, every, unit)
        com, left = apply(T, center_of_mass(athlete, q)), [legs != leg for leg in legs]
        least = max(slack(com, contacts[one], unit[one], SETTINGS, tether, T, weight) for one in left)
        for share in (0.98, 1.02):
            drum = replace(tether, most_force=share * least if 1.0 < least < np.inf else tether.most_force)
            held = held_tables(athlete, SETTINGS, drum)
            alone = least_held_ratio(poses, T, contacts, unit, every, held)
            found = torque_of(poses, T, read_only(contacts), unit, every, checks._replace(held=held))
            assert (found <= 1.0) == (alone <= 1.0 and least <= drum.most_force), (alone, least, drum.most_force)
            seen.add((bool(alone <= 1.0), bool(least <= drum.most_force), bool(least < np.inf)))
    assert seen >= {(True, True, True), (True, False, True)}


@pytest.mark.parametrize(("own", "off"), [(0.01, 0.0), (0.01, 0.04), (0.03, 0.02), (0.0, 0.05)])
def test_what_turned_ground_is_off_is_not_spent_between_samples(athlete, own, off):
    """Between two samples nothing comes nearer than half of their gap, and the site's ground may be ``off`` higher."""
    whole = without_holes_between(wavy(), np.full(2, -2.0), np.full(2, 2.0), np.empty((0, 3)))
    assert whole is not None
    frame = SlopeFrame(0.0, 0.0, whole.dem)
    frame.__dict__["off"] = off
    hung = Hung(frame, Tether(np.array([-3.0, 0.0, 3.0]), np.array([-1.05, 0.615, -0.1])))
    settings = WalkSettings(clearance=own + off)
    ground, T_site_base = Nearby(whole.dem, whole.filled), transform(translation=(0.0, 0.0, 1.5))
    checks = World(athlete, ground, settings, T_site_base, hung).first.checks
    assert checks.gap / 2 + off <= max(settings.clearance, off + LEAST_GAP / 2)
    # and the tether, which is asked at the same samples, is as far from the ground as before
    assert checks.tether.line[0, 6] == pytest.approx(hung.tether.clearance + own + off)
