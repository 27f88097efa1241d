"""How deep two links are in each other, against the hull of all differences of their corners."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from footfall.core.frames import apply
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.collision import CollisionScene
from footfall.robot.meshes.depth import overlap

LINKS = ("wheel", "knee_roll", "ankle_pitch", "hip_pitch")


def depth_of_differences(athlete, posture, a, b):
    """The least shift that parts two convex bodies: how far the origin is inside their Minkowski difference."""
    poses = link_poses(athlete, posture)
    corners_a, corners_b = (apply(poses[link], athlete.description.meshes[link].vertices) for link in (a, b))
    hull = ConvexHull((corners_a[:, None] - corners_b[None]).reshape(-1, 3))
    return max(float(-hull.equations[:, 3].max()), 0.0)


@pytest.mark.parametrize("turned", [0.3, 0.93, 0.96, 1.0])
def test_depth_of_links_in_each_other(athlete, turned):
    posture = athlete.posture("stand").copy()
    posture[12] += turned
    posture[18] -= turned
    deep = []
    for first in LINKS:
        for second in LINKS:
            pair = f"leg2_{first}", f"leg3_{second}"
            found, expected = overlap(athlete, posture, *pair), depth_of_differences(athlete, posture, *pair)
            assert found == pytest.approx(expected, abs=2e-4), pair
            deep.append(found)
    assert (max(deep) > 0) == (turned > 0.5)


def test_links_side_by_side_have_no_depth(athlete):
    posture = athlete.posture("stand")
    assert overlap(athlete, posture, "leg0_wheel", "base") == 0
    assert overlap(athlete, posture, "leg0_hip_yaw", "base") > 0  # it turns in its mount


def test_of_a_standing_leg_the_link_is_named_that_the_moving_one_is_deepest_in(athlete, rng):
    """A scene keeps a standing leg in one piece; which of its links is cut most is found when it is told."""
    posture = athlete.posture("stand")
    scene = CollisionScene(athlete, posture, 0, np.eye(4))
    several = 0
    for q in rng.uniform(athlete.lower[:6], athlete.upper[:6], (400, 6)):
        whole = np.concatenate([q, posture[6:]])
        for hit in scene.contacts(q, "none"):
            if hit.distance > 0 or hit.link_b[:4] in ("base", "leg0"):
                continue
            links = [link_name(int(hit.link_b[3]), part) for part in PARTS]
            depths = {link: depth_of_differences(athlete, whole, hit.link_a, link) for link in links}
            several += sum(depth > 0 for depth in depths.values()) > 1
            assert depths[hit.link_b] == pytest.approx(max(depths.values()), abs=2e-4), hit
    assert several > 5
