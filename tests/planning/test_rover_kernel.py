"""The compiled check of the whole rover against meshes, pin and the exact pairs: clear is never too near."""

from types import SimpleNamespace

import numpy as np
import pytest

import footfall
from benchmarks.rover_check import asked_of_ground, least_spare, on_known_ground
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply, rotation
from footfall.planning.scene.rover_kernel import (
    BEYOND,
    BODIES,
    CLEAR,
    LIFTED,
    STANDING,
    TOUCHING,
    center_of_mass,
    first_too_near,
    place_rover,
    rovers_are_clear,
)
from footfall.planning.scene.rover_tables import named, rover_tables
from footfall.planning.scene.whole_body import WholeBody
from footfall.robot import kinematics
from footfall.robot.description import PARTS, link_name, with_payload
from footfall.robot.meshes.collision import posture_collisions
from footfall.robot.model import Robot
from footfall.terrain.generate import fractal
from tests.support.chassis_ground import wavy

RAISED = 0.06
CLEARANCE = 0.01


STANCE = np.zeros((6, 6))
UP = STANCE - (0.0, 1.9, 0.0, 0.0, 0.0, 0.0)
INWARD = STANCE + np.eye(6, 1) * (0.0, 0.9, 1.0, 0.0, -0.4, 0.0)
CROSSED = STANCE + [(0.8 * sign, 0.0, 0.0, 0.0, 0.0, 0.0) for sign in (1, -1, 1, -1, 1, -1)]
"""By what the joints of each leg are turned from the stance [rad]."""


def scene_of(robot, dem, clearance=CLEARANCE, **cut):
    return SimpleNamespace(
        robot=robot,
        dem=dem,
        state=footfall.stand(robot, dem),
        body=WholeBody(robot, on_known_ground(dem), clearance),
        tables=rover_tables(robot, dem.heights, dem.geometry, clearance, **cut),
    )


@pytest.fixture(scope="module")
def rock(athlete):
    return scene_of(athlete, wavy([(0.6, 0.3, 0.5, 0.5)]))


@pytest.fixture(scope="module")
def steep(athlete):
    """Rolling ground in cells of 5 cm, and a payload that hangs below the deck."""
    loaded = Robot(with_payload(athlete.description, 200.0, (0.8, 0.7, 0.5), (0.1, -0.1, -0.35)))
    return scene_of(loaded, fractal(9.0, 0.05, 0.12, 0.8, 5))


def drawn(scene, rng, count, spread, rise, turned=STANCE):
    """Configurations about the stance with its joints turned, and by ``spread``, the chassis higher by ``rise``."""
    robot, state = scene.robot, scene.state
    qs = np.clip(state.posture + np.ravel(turned) + rng.normal(0.0, spread, (count, 36)), robot.lower, robot.upper)
    Ts = np.tile(state.T_site_base, (count, 1, 1))
    for T in Ts:
        T[:3, :3] = T[:3, :3] @ rotation("x", rng.normal(0.0, 0.1)) @ rotation("y", rng.normal(0.0, 0.1))
        T[:3, :3] = rotation("z", rng.uniform(-3.0, 3.0)) @ T[:3, :3]
    Ts[:, :2, 3] += rng.uniform(-0.3, 0.3, (count, 2))
    Ts[:, 2, 3] += rng.uniform(*rise, count)
    return qs, Ts, rng.choice([STANDING, TOUCHING, LIFTED], (count, robot.leg_count), p=[0.6, 0.2, 0.2])


DRAWS = {
    "itself": (0.65, (0.8, 1.2)),
    "ground": (0.12, (-0.3, 0.25)),
    "chassis": (0.1, (-1.7, -0.9), UP),
}
"""What is mostly too near, and how such configurations are drawn."""


def too_near(scene, what, q, T, standing):
    own, ground = least_spare(scene.body, q, T, standing, RAISED)
    if what == "chassis":
        chassis = scene.body.ground_gap(T @ scene.body.poses(q[None]), ["base"]).gap.spare
        return min(own, ground) < 0, chassis < 0
    return min(own, ground) < 0, (own if what == "itself" else ground) < 0


@pytest.mark.parametrize("what", DRAWS)
@pytest.mark.parametrize("name", ["rock", "steep"])
def test_what_is_called_clear_keeps_every_distance(request, rng, name, what):
    scene = request.getfixturevalue(name)
    qs, Ts, standing = drawn(scene, rng, 70, *DRAWS[what])
    codes = rovers_are_clear(qs, Ts, standing, RAISED, scene.tables)
    exact = np.array([too_near(scene, what, *one) for one in zip(qs, Ts, standing, strict=True)])
    broken, asked = exact.T
    assert not (broken & (codes == CLEAR)).any()
    assert asked.mean() > 1 / 3
    assert (~broken).sum() > 5
    assert (codes[~broken] == CLEAR).mean() > 0.7


@pytest.mark.parametrize("what", DRAWS)
@pytest.mark.parametrize("name", ["rock", "steep"])
def test_where_clear_ends_every_distance_is_still_kept(request, rng, name, what):
    scene = request.getfixturevalue(name)
    spread, (_, high), *turned = DRAWS[what]
    qs, Ts, standing = drawn(scene, rng, 600, spread, (high - 1.0, high + 0.8), *turned)
    clear = rovers_are_clear(qs, Ts, standing, RAISED, scene.tables) == CLEAR
    yes, no = rng.choice(np.flatnonzero(clear), 40), rng.choice(np.flatnonzero(~clear), 40)
    legs, turned = standing[yes], Ts[yes]

    def between(share):
        T = turned.copy()
        T[:, :3, 3] += share[:, None] * (Ts[no] - Ts[yes])[:, :3, 3]
        return qs[yes] + share[:, None] * (qs[no] - qs[yes]), T

    inside, outside = np.zeros(40), np.ones(40)
    for _ in range(30):
        middle = (inside + outside) / 2
        is_clear = rovers_are_clear(*between(middle), legs, RAISED, scene.tables) == CLEAR
        inside, outside = np.where(is_clear, middle, inside), np.where(is_clear, outside, middle)
    spare = np.array([min(least_spare(scene.body, *one, RAISED)) for one in zip(*between(inside), legs, strict=True)])
    assert spare.min() >= 0.0
    # the search did end where something is near
    assert np.median(spare) < 0.03


@pytest.mark.parametrize("name", ["rock", "steep"])
def test_links_and_the_centre_of_mass_are_where_pin_has_them(request, rng, name):
    scene = request.getfixturevalue(name)
    robot, tables = scene.robot, scene.tables
    poses = np.empty((42, 3, 4))
    for q, T, _ in zip(*drawn(scene, rng, 20, 0.7, (-1.0, 1.0)), strict=True):
        base = T[:3].copy()
        place_rover(q, base, tables, poses)
        known = kinematics.link_poses(robot, q)
        for leg in robot.legs:
            for i, part in enumerate(PARTS):
                np.testing.assert_allclose(poses[7 * leg + i], (T @ known[link_name(leg, part)])[:3], atol=1e-9)
        expected = apply(T, kinematics.center_of_mass(robot, q))
        np.testing.assert_allclose(center_of_mass(poses, base, tables), expected, atol=1e-9)


def exact_breaches(scene, q, T, standing):
    """Each pair that is too near by the meshes, in the words of ``named``."""
    found = {
        frozenset((in_words(hit.link_a), in_words(hit.link_b)))
        for hit in posture_collisions(scene.robot, q, T, None, CLEARANCE)
    }
    Ts = T @ scene.body.poses(q[None])
    for links, raised in zip(asked_of_ground(scene.robot, standing), (0.0, RAISED), strict=True):
        for link in links:
            touching = np.flatnonzero(standing == TOUCHING).tolist()
            if scene.body.ground_gap(Ts, [link], raised, touching).gap.spare < 0:
                found.add(frozenset((in_words(link), "the terrain")))
    return found


def in_words(link):
    words = dict(zip(PARTS, ("hip", "thigh", "knee", "shank", "ankle", "foot", "wheel"), strict=True))
    if link.startswith("leg"):
        return f"leg {link[3]} {words[link[5:]]}"
    return {"base": "chassis"}.get(link, link)


KINDS = {
    "one leg": lambda a, b: a[:5] == b[:5] and a[:3] == "leg",
    "two legs": lambda a, b: a[:3] == b[:3] == "leg" and a[:5] != b[:5],
    "leg and chassis": lambda a, b: a[:3] == "leg" and b == "chassis",
    "leg and payload": lambda a, b: a[:3] == "leg" and b == "payload",
    "leg and the terrain": lambda a, b: a[:3] == "leg" and b == "the terrain",
    "chassis and the terrain": lambda a, b: (a, b) == ("chassis", "the terrain"),
    "payload and the terrain": lambda a, b: (a, b) == ("payload", "the terrain"),
}


def test_each_kind_of_breach_is_seen_and_named(rock, steep, rng):
    draws = [
        (steep, (0.5, (0.3, 1.0))),
        (steep, (0.1, (0.3, 1.0), CROSSED)),
        (steep, (0.2, (0.8, 1.2), INWARD)),
        (steep, (0.12, (-0.1, 0.3))),
        (steep, (0.1, (-1.5, -0.7), UP)),
        (rock, (0.1, (-1.7, -0.9), UP)),
    ]
    seen = dict.fromkeys(KINDS, 0)
    for scene, draw in draws:
        qs, Ts, standing = drawn(scene, rng, 300, *draw)
        codes = rovers_are_clear(qs, Ts, standing, RAISED, scene.tables)
        for kind, is_kind in KINDS.items():
            told = [i for i in np.flatnonzero(codes != CLEAR) if is_kind(*named(codes[i]).split(" and "))]
            for i in told[:8]:
                if not seen[kind]:
                    exact = exact_breaches(scene, qs[i], Ts[i], standing[i])
                    seen[kind] += exact == {frozenset(named(codes[i]).split(" and "))}
    # of each kind there were rovers that fail in exactly one pair, and that pair was told
    assert all(seen.values()), seen


def first_of(scene, q, T, standing, raised=0.0):
    poses, base = np.empty((42, 3, 4)), np.array(T[:3])
    place_rover(np.array(q), base, scene.tables, poses)
    return first_too_near(poses, base, np.asarray(standing, np.int64), raised, scene.tables)


def test_wheels_that_stand_may_touch_and_others_not(rock):
    q, T = rock.state.posture, rock.state.T_site_base
    standing = np.ones(6, bool)
    assert first_of(rock, q, T, standing)[0] == CLEAR
    for leg in rock.robot.legs:
        code, spare = first_of(rock, q, T, standing & (np.arange(6) != leg))
        assert named(code) == f"leg {leg} wheel and the terrain"
        assert -0.1 < spare < 0.0
        # on its way up or down it may, but not sink in
        touching = np.where(np.arange(6) == leg, TOUCHING, STANDING)
        assert first_of(rock, q, T, touching, 0.5)[0] == CLEAR
        sunk = np.array(T)
        sunk[2, 3] -= rock.robot.description.clearances.wheel_sink + 0.005
        assert named(first_of(rock, q, sunk, touching, 0.5)[0]) == f"leg {leg} wheel and the terrain"


@pytest.mark.parametrize("foot", [LIFTED, STANDING, TOUCHING])
def test_a_pillar_under_a_thigh_is_seen_whatever_the_foot_does(athlete, foot):
    posture, T = athlete.posture("stand"), np.eye(4)
    T[2, 3] = -kinematics.wheel_centers(athlete, posture)[0, 2] + athlete.wheel_radius + 0.1
    thigh = T @ kinematics.link_poses(athlete, posture)[link_name(0, "hip_pitch")]
    x, y, top = thigh[:3, 3] + 0.35 * thigh[:3, 0]
    pillar = wavy([(x, y, 0.15, top)])
    around = SimpleNamespace(tables=rover_tables(athlete, pillar.heights, pillar.geometry))
    feet = np.where(np.arange(6) == 0, foot, STANDING)
    assert named(first_of(around, posture, T, feet)[0]) == "leg 0 thigh and the terrain"
    around.tables = rover_tables(athlete, wavy().heights, wavy().geometry)
    assert first_of(around, posture, T, feet)[0] == CLEAR


def test_feet_as_whole_numbers_say_the_same_as_those_that_stand(rock, rng):
    qs, Ts, _ = drawn(rock, rng, 200, *DRAWS["ground"])
    standing = rng.random((200, 6)) < 0.7
    numbers = np.where(standing, STANDING, LIFTED)
    codes = rovers_are_clear(qs, Ts, standing, RAISED, rock.tables)
    assert np.array_equal(codes, rovers_are_clear(qs, Ts, numbers, RAISED, rock.tables))
    assert len(np.unique(codes)) > 3


def test_ground_is_raised_for_legs_that_do_not_stand(rock):
    q, T = np.array(rock.state.posture), rock.state.T_site_base
    q[12:18] -= (0.0, 0.15, 0.0, 0.0, 0.0, 0.0)
    standing = np.arange(6) != 2
    free = rock.body.ground_gap(T @ rock.body.poses(q[None]), asked_of_ground(rock.robot, standing)[1]).gap.spare
    assert 0.1 < free < 0.19
    codes = [first_of(rock, q, T, standing, raised)[0] for raised in (0.0, free - 0.06, free + 1e-3)]
    assert codes[:2] == [CLEAR, CLEAR]
    link, _, other = named(codes[2]).partition(" and ")
    assert (link[:5], other) == ("leg 2", "the terrain")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_no_number_is_not_clear(rock, bad):
    T, standing = rock.state.T_site_base, np.ones(6, bool)
    for joint in range(36):
        q = np.array(rock.state.posture)
        q[joint] = bad
        assert first_of(rock, q, T, standing)[0] != CLEAR
    for row, column in np.ndindex(3, 4):
        moved = np.array(T)
        moved[row, column] = bad
        assert first_of(rock, rock.state.posture, moved, standing)[0] != CLEAR


def test_ground_that_was_cut_out_serves_inside_the_circle_alone(athlete, rock, rng):
    cut = scene_of(athlete, rock.dem, around=(0.2, -0.1), within=3.2)
    qs, Ts, standing = drawn(rock, rng, 500, *DRAWS["ground"])
    Ts[:, :2, 3] += rng.uniform(-1.0, 1.0, (500, 2))
    whole, part = (rovers_are_clear(qs, Ts, standing, RAISED, scene.tables) for scene in (rock, cut))
    outside = part % BODIES == BEYOND
    assert 50 < outside.sum() < 450
    assert np.array_equal(part[~outside], whole[~outside])
    poses = np.empty((42, 3, 4))
    for q, T, is_outside in zip(qs, Ts, outside, strict=True):
        place_rover(q, np.ascontiguousarray(T[:3]), cut.tables, poses)
        away = np.hypot(*(poses[:, :2, 3] - (0.2, -0.1)).T).max()
        # a link's frame may be in the circle though the link is not, by no more than a link is long
        assert is_outside or away < 3.2
        assert away > 3.2 - 0.9 or not is_outside


def test_ground_must_fit_its_geometry(athlete, rock):
    with pytest.raises(InvalidInput):
        rover_tables(athlete, rock.dem.heights[1:], rock.dem.geometry)
    with pytest.raises(InvalidInput):
        rover_tables(athlete, rock.dem.heights, rock.dem.geometry, -0.01)


def test_codes_in_words():
    assert named(CLEAR) == "nothing is too near"
    assert named((7 * 2 + 3) * BODIES + 7 * 3 + 1) == "leg 2 shank and leg 3 thigh"
    assert named((7 * 1 + 3) * BODIES + 254) == "leg 1 shank and the terrain"
    assert named(252 * BODIES + 254) == "chassis and the terrain"
