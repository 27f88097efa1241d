"""Planted turns of right cameras and of whole pairs are found by all images together."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.core import frames
from footfall.core.errors import InvalidImages
from footfall.sim.render import render_scene
from footfall.telemetry.images import ImagePair
from footfall.terrain.pairs.bundle_adjustment import refine
from footfall.terrain.pairs.epipolar import estimate_rotation

NAMES = ("haz0", "haz1", "haz2")
PAIRS = np.deg2rad([[0.0, 0.0, 0.0], [0.3, -0.25, 0.2], [-0.2, 0.3, -0.35]])
RIGHTS = np.deg2rad([[0.1, 0.15, -0.1], [-0.15, 0.0, 0.1], [0.05, -0.2, 0.0]])


def turned(turn) -> np.ndarray:
    return frames.transform(Rotation.from_rotvec(turn).as_matrix())


@pytest.fixture(scope="module")
def taken(athlete, rocks, rock_state):
    """Pairs whose cameras really are turned, with the models that say they are not."""
    scene = render_scene(athlete, rock_state, rocks)
    pairs = []
    for i, name in enumerate(NAMES):
        spec = athlete.description.camera_pair(name)
        left, right = spec.camera_left.reduced(0.5), spec.camera_right.reduced(0.5)
        T_left = left.T_base_camera @ turned(PAIRS[i])
        T_right = T_left @ frames.inverse(left.T_base_camera) @ right.T_base_camera @ turned(RIGHTS[i])
        one, other = (
            scene.image(replace(camera, T_base_camera=T), rock_state.T_site_base, np.random.default_rng([i, side]))
            for side, (camera, T) in enumerate(((left, T_left), (right, T_right)))
        )
        pairs.append(ImagePair(name, 0.0, one, other, left, right, rock_state.T_site_base))
    return tuple(pairs)


@pytest.fixture(scope="module")
def found(taken):
    return refine(taken)


def test_planted_turns_are_found(found):
    _, what = found
    assert (what.common.sum(axis=1) > 30).all()
    assert np.abs(what.right_turns - RIGHTS).max() < np.deg2rad(0.04)
    assert np.abs(what.pair_turns - PAIRS).max() < np.deg2rad(0.1)
    assert (np.abs(what.right_turns - RIGHTS) < 4 * what.right_uncertainty).all()
    assert (np.abs(what.pair_turns - PAIRS)[1:] < 4 * what.pair_uncertainty[1:]).all()
    assert what.after < 0.5 * what.before
    assert "3 pairs refined together" in what.text


def test_the_refined_pairs_stand_where_they_really_do(found, taken):
    """Independent of what the solver reports: the poses of the result against those that took the images."""
    refined, _ = found
    for pair, was, turn in zip(refined, taken, PAIRS, strict=True):
        true = was.camera_left.T_base_camera @ turned(turn)
        off = Rotation.from_matrix(true[:3, :3].T @ pair.camera_left.T_base_camera[:3, :3]).magnitude()
        assert off < np.deg2rad(0.15)
        assert np.array_equal(pair.camera_left.T_base_camera[:3, 3], was.camera_left.T_base_camera[:3, 3])
        assert pair.baseline == pytest.approx(was.baseline, abs=1e-9)
    assert refined[0].camera_left.digest == taken[0].camera_left.digest


def test_good_pairs_stay_and_the_same_images_give_the_same(rock_snapshot):
    pairs = [pair for pair in rock_snapshot.pairs if pair.name in NAMES]
    _, what = refine(pairs)
    assert np.abs(what.pair_turns).max() < np.deg2rad(0.1)
    assert np.abs(what.right_turns).max() < np.deg2rad(0.03)
    assert refine(pairs)[1].digest == what.digest


def test_pairs_that_share_nothing_keep_their_poses(taken):
    alone = taken[0]
    refined, what = refine([alone])
    assert np.isnan(what.before)
    assert "no common ground" in what.text
    assert refined[0].camera_left.digest == alone.camera_left.digest
    assert (np.abs(what.right_turns[0] - RIGHTS[0]) < 4 * what.right_uncertainty[0]).all()
    assert what.right_uncertainty[0].max() < np.deg2rad(0.05)
    # what the pair alone is asked, and is judged by afterwards: a joint solution would let mistaken matches pull
    np.testing.assert_array_equal(what.right_turns[0], estimate_rotation(alone).rotation)
    blind = replace(taken[1], left=np.full_like(taken[1].left, 90), right=np.full_like(taken[1].right, 90))
    refined, what = refine([alone, blind])
    assert not what.common.any()
    assert not what.pair_turns.any()
    with pytest.raises(InvalidImages, match="no image pair"):
        refine([])
