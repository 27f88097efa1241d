"""What surely collides, against exact meshes: never a false alarm, and most of what collides is told."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from footfall.core.errors import InvalidInput
from footfall.core.frames import rotation_rpy, transform
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance
from footfall.robot.description import PARTS, with_payload
from footfall.robot.meshes.collision import GROUND_MODES, CollisionScene
from footfall.robot.meshes.first_contact import NamingScene
from footfall.robot.model import Robot
from footfall.robot.proof.leg_overlap import LegOverlap
from footfall.robot.proof.obstacles import CHASSIS, LEG, NOTHING, PAYLOAD, SELF, TERRAIN
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate

LEG_NUMBER = 1
CLEARANCE, RAISED = 0.01, 0.15


@pytest.fixture(scope="module", params=[False, True], ids=["bare", "laden"])
def robot(request, athlete):
    return Robot(with_payload(athlete.description, 100.0)) if request.param else athlete


@pytest.fixture(scope="module", params=[0.03, 0.07])
def ground(request):
    """Bumps of some 15 cm, with a hole."""
    cells = int(7 / request.param)
    rng = np.random.default_rng(8)
    heights = gaussian_filter(rng.normal(size=(cells, cells)), 0.25 / request.param)
    heights *= 0.12 / heights.std()
    heights[cells // 2 : cells // 2 + 9, cells // 2 : cells // 2 + 14] = np.nan
    grid = GridGeometry(-3.5, -3.5, request.param, cells, cells)
    return Dem(heights.astype(np.float32), grid, "bumps", Provenance({}))


@pytest.fixture(scope="module")
def setting(robot, ground):
    posture = np.array(robot.posture("stand"))
    posture[::6] = 0.3
    return posture, transform(rotation_rpy(0.06, -0.04, 0.5), (0.1, -0.2, 1.15)), triangulate(ground)


@pytest.fixture(scope="module")
def overlap(robot, ground, setting):
    posture, T_site_base, _ = setting
    return LegOverlap(robot, posture, LEG_NUMBER, T_site_base, ground.heights, ground.geometry, CLEARANCE, RAISED)


@pytest.fixture(scope="module")
def scene(robot, setting):
    posture, T_site_base, mesh = setting
    return NamingScene(robot, posture, LEG_NUMBER, T_site_base, mesh, CLEARANCE, RAISED)


def random_postures(robot, n, seed):
    own = slice(6 * LEG_NUMBER, 6 * LEG_NUMBER + 6)
    rng = np.random.default_rng(seed)
    qs = rng.uniform(robot.lower[own], robot.upper[own], (n, 6))
    # half of them near the stand, where links pass each other closely
    qs[::2] = robot.posture("stand")[own] + rng.normal(size=(len(qs[::2]), 6)) * 0.5
    return qs


@pytest.mark.parametrize("mode", GROUND_MODES)
def test_what_is_sure_is_so(robot, setting, overlap, scene, mode):
    qs = random_postures(robot, 600, 4)
    link, hit = overlap.certain(qs, mode)
    collides = np.array([scene.collides(q, mode) for q in qs])
    sure = hit != NOTHING
    assert not (sure & ~collides).any()
    assert sure.sum() > 0.75 * collides.sum()
    assert (~collides).any()
    # the pair that is named is one of those that are too close
    for q, one, other in list(zip(qs[sure], link[sure], hit[sure], strict=True))[:25]:
        pairs = {tuple(_told(hit)) for hit in scene.contacts(q, mode)}
        assert (PARTS[one], int(other)) in pairs


def _told(hit):
    part = hit.link_a.split("_", 1)[1]
    if hit.link_b.startswith(f"leg{LEG_NUMBER}_"):
        return max(part, hit.link_b.split("_", 1)[1], key=PARTS.index), SELF
    codes = {"base": CHASSIS, "payload": PAYLOAD, "terrain": TERRAIN}
    return part, codes.get(hit.link_b) or LEG + int(hit.link_b[3])


@pytest.mark.parametrize("mode", GROUND_MODES)
def test_the_first_contact_is_a_contact(robot, setting, scene, mode):
    posture, T_site_base, mesh = setting
    plain = CollisionScene(robot, posture, LEG_NUMBER, T_site_base, mesh, CLEARANCE, RAISED)
    found = 0
    for q in random_postures(robot, 120, 6):
        pair = scene.first_contact(q, mode)
        assert (pair is not None) == plain.collides(q, mode)
        if pair is not None:
            found += 1
            names = {(hit.link_a, hit.link_b.split("_")[0]) for hit in plain.contacts(q, mode)}
            assert (pair[0], pair[1].split("_")[0]) in names
    assert 10 < found < 120


def test_a_leg_far_from_everything_hits_nothing(athlete, ground):
    T_site_base = transform(translation=(0.0, 0.0, 30.0))
    overlap = LegOverlap(athlete, athlete.posture("stand"), 0, T_site_base, ground.heights, ground.geometry)
    _, hit = overlap.certain(athlete.posture("stand")[None, :6], "true")
    assert hit[0] == NOTHING


def test_bad_input_is_refused(athlete, ground, overlap):
    with pytest.raises(InvalidInput, match="do not fit"):
        LegOverlap(athlete, athlete.posture("stand"), 0, np.eye(4), ground.heights[1:], ground.geometry)
    with pytest.raises(InvalidInput, match=r"\(n, 6\)"):
        overlap.certain(np.zeros(6), "true")
    with pytest.raises(InvalidInput, match="true, raised, none"):
        overlap.certain(np.zeros((1, 6)), "sea")
    assert len(overlap.certain(np.zeros((0, 6)), "true")[0]) == 0
