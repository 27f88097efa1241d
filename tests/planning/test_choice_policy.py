"""States in classes, tables to files and back, refusals of tables of others, and what the ground tells."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidBundle, InvalidInput
from footfall.io.artifacts import encode
from footfall.io.policies import read_policy, write_policy
from footfall.planning.choice.actions import (
    ACTION_TEXTS,
    ACTIONS,
    OFFSET,
    TRIPOD,
    TRIPOD_ASIDE,
    WALK,
    WALK_ASIDE,
    WAYS,
)
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.ground_layers import features_at, ground_of, offset_of
from footfall.planning.choice.mdp import SeenTransition
from footfall.planning.choice.policy import VERSION, learned, require_made_for
from footfall.planning.choice.state import Features, StateSpace
from footfall.terrain.from_arrays import from_heights

limits = st.lists(st.integers(-8, 8), max_size=3, unique=True).map(
    lambda some: tuple(0.125 * one for one in sorted(some))
)
spaces = st.builds(StateSpace, traversability=limits, slope_ahead=limits, lean=limits, age=limits, sides=st.booleans())
numbers = st.floats(-2.0, 2.0)
seen_features = st.builds(
    Features, numbers, numbers, numbers, numbers, st.sampled_from(ACTIONS), st.booleans(), numbers, st.booleans()
)
SETTINGS = ChoiceSettings(space=StateSpace((0.5,)))
ROBOT = "0" * 32


@given(spaces, seen_features, seen_features)
def test_states_are_the_same_where_all_classes_are(space, one, other):
    """Second method: classes as counts of limits that are not above."""

    def classes(features):
        names = ("traversability", "slope_ahead", "lean", "age")
        counts = [sum(getattr(features, name) >= limit for limit in getattr(space, name)) for name in names]
        above = sum(limit <= features.aside for limit in space.traversability) > counts[0]
        current = {TRIPOD_ASIDE: TRIPOD, WALK_ASIDE: WALK}.get(features.current, features.current)
        return (*counts, int(space.sides and above), int(features.refused), WAYS.index(current))

    assert space.index(one) == np.ravel_multi_index(classes(one), space.shape)
    assert (space.index(one) == space.index(other)) == (classes(one) == classes(other))
    assert (space.in_words(space.index(one)) == space.in_words(space.index(other))) == (classes(one) == classes(other))


def test_every_action_is_told():
    assert set(ACTION_TEXTS) == set(ACTIONS)


def test_a_state_in_words():
    space = StateSpace(traversability=(0.2, 0.6))
    told = space.in_words(space.index(Features(0.3, current=TRIPOD, refused=True)))
    assert told == "0.2 ≤ traversability < 0.6, after tripod that was refused"
    aside = replace(space, sides=True)
    told = aside.in_words(aside.index(Features(0.1, aside=0.9, current=WALK_ASIDE)))
    assert told == "traversability < 0.2, better aside, after walk"


def transitions(rng: np.random.Generator, count: int = 60) -> list[SeenTransition]:
    size = SETTINGS.space.size
    states = rng.integers(0, size, (count, 2))
    return [SeenTransition(int(a), int(rng.integers(len(ACTIONS))), float(rng.normal()), int(b)) for a, b in states]


@given(st.integers(0, 2**32 - 1))
def test_a_table_comes_back_from_its_file(tmp_path_factory, seed):
    policy = learned(transitions(np.random.default_rng(seed)), SETTINGS, ROBOT, 3)
    path = tmp_path_factory.mktemp("policies") / "gaits.npz"
    write_policy(path, policy)
    back = read_policy(path, ROBOT, SETTINGS)
    assert back.digest == policy.digest
    assert encode(back) == path.read_bytes()
    rng = np.random.default_rng(seed)
    for _ in range(20):
        features = Features(rng.random(), current=str(rng.choice(ACTIONS)), refused=bool(rng.integers(2)))
        chosen = policy.choose(features)
        assert back.choose(features) == chosen
        row = policy.action_values[SETTINGS.space.index(features)]
        assert row[ACTIONS.index(chosen)] == row.max()


def test_what_was_never_tried_is_not_chosen():
    policy = learned(transitions(np.random.default_rng(1), 20), SETTINGS, ROBOT, 3)
    rows = np.arange(SETTINGS.space.size)
    some = policy.visits.any(axis=1)
    assert some.any()
    assert not some.all()
    assert (policy.visits[rows, policy.choices] > 0)[some].all()
    # where nothing was tried the walk planner goes on
    assert (policy.choices[~some] == ACTIONS.index(WALK)).all()


def test_what_may_not_be_chosen_counts_for_nothing():
    """A table of settings without an action is that of what was seen without it."""
    seen = transitions(np.random.default_rng(4), 200)
    straight = [one for one in seen if ACTIONS[one.action] in WAYS]
    assert len(straight) < len(seen)
    assert learned(seen, SETTINGS, ROBOT, 3).digest == learned(straight, SETTINGS, ROBOT, 3).digest
    all_of_them = learned(seen, replace(SETTINGS, actions=ACTIONS), ROBOT, 3)
    assert (all_of_them.visits.sum(), learned(seen, SETTINGS, ROBOT, 3).visits.sum()) == (len(seen), len(straight))


def test_tables_of_others_are_refused(tmp_path):
    policy = learned(transitions(np.random.default_rng(2)), SETTINGS, ROBOT, 3)
    require_made_for(policy, ROBOT)
    with pytest.raises(InvalidInput, match="learned for robot 00000000"):
        require_made_for(policy, "1" * 32)
    with pytest.raises(InvalidInput, match="learned with settings"):
        require_made_for(policy, ROBOT, replace(SETTINGS, ahead=0.5))
    later = replace(policy, version=VERSION + 1)
    write_policy(tmp_path / "later.npz", later)
    with pytest.raises(InvalidInput, match=f"version {VERSION + 1}"):
        read_policy(tmp_path / "later.npz", ROBOT)
    (tmp_path / "other.npz").write_bytes(encode(SETTINGS))
    with pytest.raises(InvalidBundle, match="holds ChoiceSettings, no policy"):
        read_policy(tmp_path / "other.npz", ROBOT)
    (tmp_path / "broken.npz").write_bytes(b"broken")
    with pytest.raises(InvalidBundle, match="broken"):
        read_policy(tmp_path / "broken.npz", ROBOT)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: StateSpace((0.5, 0.5)), "rise"),
        (lambda: StateSpace(age=(float("nan"),)), "finite"),
        (lambda: StateSpace().index(Features(float("nan"))), "not a number"),
        (lambda: StateSpace(sides=True).index(Features(0.5, aside=float("nan"))), "not a number"),
        (lambda: StateSpace().index(Features(0.5, current="trot")), "one of"),
        (lambda: ChoiceSettings(discount=1.0), "below 1"),
        (lambda: ChoiceSettings(speed=1.5), "at most 1"),
        (lambda: ChoiceSettings(ahead=0.0), "ahead"),
        (lambda: ChoiceSettings(actions=(WALK, "trot")), "some of wave"),
        (lambda: ChoiceSettings(actions=(TRIPOD,)), "the walk planner among them"),
    ],
)
def test_misuse(make, words):
    with pytest.raises(InvalidInput, match=words):
        make()


def ground(change, half=6.0):
    x, y = np.meshgrid(np.arange(-half, half + 0.05, 0.1), np.arange(-half, half + 0.05, 0.1))
    return from_heights(change(x, y).astype(np.float32), 0.1, -half, -half, "made")


def at(x, y, lean=0.0):
    T = np.eye(4)
    T[:3, 3] = x, y, 1.0
    T[:3, :3] = [[np.cos(lean), 0, np.sin(lean)], [0, 1, 0], [-np.sin(lean), 0, np.cos(lean)]]
    return T


def test_what_the_ground_tells(athlete):
    """A ramp of slope 0.2 to the east: uphill, downhill and across; good as slopes of 0.2 of 0.436 rad are."""
    ramp = ground_of(athlete, ground(lambda x, y: np.tan(0.2) * x))
    for onto, rise in (((0.6, 0.0), 0.2), ((-0.6, 0.0), -0.2), ((0.0, 0.6), 0.0)):
        found = features_at(ramp, at(0, 0, 0.1), np.array(onto))
        assert found.slope_ahead == pytest.approx(rise, abs=1e-3)
        assert found.traversability == pytest.approx(1 - 0.2 / 0.436, abs=0.02)
        assert found.lean == pytest.approx(0.1)


def test_one_bad_place_near_the_way_counts_and_one_beyond_it_does_not(athlete):
    rock = ground_of(athlete, ground(lambda x, y: np.where(np.hypot(x - 3.0, y) < 0.3, 0.4, 0.0), 7.0))
    x = 3.0 - 0.7 - rock.around
    near = features_at(rock, at(x, 0), np.array([x + 0.6, 0.0]))
    away = features_at(rock, at(x, 0), np.array([x - 0.6, 0.0]))
    assert near.traversability < 0.2
    assert away.traversability > 0.9


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_better_side_is_known_and_is_where_an_action_aside_goes(side, athlete):
    """A rock beside the way: the ground to the other side is better, by the same look straight there."""
    beside = ground_of(athlete, ground(lambda x, y: 0.0 * x)).around + 0.1
    rock = ground_of(athlete, ground(lambda x, y: np.where(np.hypot(x - 2.0, y + side * beside) < 0.3, 0.4, 0.0), 7.0))
    onto = np.array([1.5, 0.0])
    found = features_at(rock, at(0, 0), onto)
    assert found.left == (side > 0)
    assert found.traversability < 0.5 < found.aside
    turned = 1.5 * np.array([np.cos(side * OFFSET), np.sin(side * OFFSET)])
    assert found.aside == pytest.approx(features_at(rock, at(0, 0), turned).traversability)
    assert [offset_of(one, found) for one in (TRIPOD_ASIDE, WALK_ASIDE)] == [side * OFFSET] * 2
    assert {offset_of(one, found) for one in WAYS} == {0.0}


def test_unknown_ground_and_the_edge_of_the_map_are_bad(athlete):
    hole = ground_of(athlete, ground(lambda x, y: np.where(np.hypot(x, y - 1.0) < 0.2, np.nan, 0.0)))
    assert features_at(hole, at(0, 0), np.array([0.6, 0.0])).traversability < 0.9
    level = ground_of(athlete, ground(lambda x, y: 0.0 * x))
    assert features_at(level, at(0, 0), np.array([0.6, 0.0])).traversability == pytest.approx(1.0)
    over = features_at(level, at(5.5, 0), np.array([6.1, 0.0]))
    assert over.traversability == over.aside == 0.0
