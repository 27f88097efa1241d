"""Learning over made routes: the same table whatever the processes and interruptions, and figures by second methods."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, bootstrap

from footfall.core.errors import InvalidInput
from footfall.io.policies import shipped_policy
from footfall.planning.choice.actions import ACTIONS, TRIPOD, WALK, WAVE
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.planning.choice.mdp import SeenTransition
from footfall.planning.choice.policy import learned, require_made_for
from footfall.planning.choice.reward import Came, RewardWeights, reward
from footfall.planning.choice.state import Features, StateSpace
from footfall.terrain.from_arrays import from_heights
from training import choosers
from training.evaluate import figures, total, verdicts
from training.finished import Finished, completed
from training.gait_policy import SETTINGS as SHIPPED_SETTINGS
from training.gait_policy import transitions, tried, what_rollouts_are_of
from training.grounds import AROUND, FAMILIES, LEARNED, UNSEEN, family, ground, part_of
from training.intervals import mean, ratio, share
from training.route import ARRIVED, STUCK, Decision, Route, robot, route_from

SETTINGS = ChoiceSettings(space=StateSpace((0.3, 0.6)))
SEEDS = range(6)


def made_route(seed: int) -> Route:
    """A route that was never walked, of numbers drawn from its seed."""
    rng = np.random.default_rng(seed)
    features = Features(float(rng.random()))
    decisions = []
    for _ in range(int(rng.integers(3, 20))):
        action, refused = str(rng.choice(ACTIONS)), bool(rng.random() < 0.3)
        went = Came(float(rng.uniform(0.4, 0.6)), float(rng.uniform(5, 15)), float(rng.uniform(10, 90)), 6)
        came = Came(refused=True, mishap="torque" if rng.random() < 0.5 else "") if refused else went
        after = Features(float(rng.random()), current=action, refused=refused)
        decisions.append(Decision(features, action, came, after))
        features = after
    return Route(seed, ARRIVED if rng.random() < 0.7 else STUCK, tuple(decisions), float(rng.random()))


def made(task):
    """As ``completed`` wants it; in a module, so that other processes find it."""
    key, seed = task
    return key, made_route(seed).as_json


def table(path, processes: int, seeds=SEEDS) -> str:
    finished = Finished(path, {"made": 1})
    items = completed(finished, [(str(seed), seed) for seed in seeds], made, lambda _: None, processes)
    return learned(transitions(map(route_from, items), SETTINGS), SETTINGS, "0" * 32, len(seeds)).digest


def test_routes_come_back_from_json():
    for seed in SEEDS:
        route = made_route(seed)
        assert route_from(json.loads(json.dumps(route.as_json)), route.planning) == route


def test_the_table_is_the_same_whatever_the_processes(tmp_path):
    alone = table(tmp_path / "one.jsonl", 1)
    assert table(tmp_path / "two.jsonl", 2) == alone
    # and as the order is that of seeds, one of arrival would have shown
    assert table(tmp_path / "other.jsonl", 1, range(1, 7)) != alone


def test_order_of_arrival_does_not_count(tmp_path):
    alone = table(tmp_path / "one.jsonl", 1)
    path = tmp_path / "backwards.jsonl"
    finished = Finished(path, {"made": 1})
    for seed in reversed(SEEDS):
        finished.put(*made((str(seed), seed)))
    assert table(path, 1) == alone


@pytest.mark.parametrize("kept", [0.3, 0.55, 0.8, 1.0])
def test_an_interrupted_run_goes_on(tmp_path, kept):
    whole = table(tmp_path / "whole.jsonl", 1)
    content = (tmp_path / "whole.jsonl").read_bytes()
    path = tmp_path / "cut.jsonl"
    path.write_bytes(content[: int(kept * len(content))])
    there = path.read_bytes().count(b"\n") - 1
    again = []
    finished = Finished(path, {"made": 1})

    def counted(task):
        again.append(task)
        return made(task)

    list(completed(finished, [(str(seed), seed) for seed in SEEDS], counted, lambda _: None))
    assert len(again) == len(SEEDS) - there
    assert table(path, 1) == whole
    assert path.read_bytes() == content


def test_finished_routes_of_something_else_are_refused(tmp_path):
    path = tmp_path / "routes.jsonl"
    Finished(path, what_rollouts_are_of(6.0, SETTINGS))
    Finished(path, what_rollouts_are_of(6.0, replace(SETTINGS, weights=RewardWeights(mishap=3.0), discount=0.5)))
    with pytest.raises(InvalidInput, match="choose another file"):
        Finished(path, what_rollouts_are_of(6.0, replace(SETTINGS, ahead=0.5)))
    with pytest.raises(InvalidInput, match="choose another file"):
        Finished(path, what_rollouts_are_of(5.0, SETTINGS))
    path.write_text(path.read_text() + "{\n")
    with pytest.raises(InvalidInput, match="its line 2 is damaged"):
        Finished(path, what_rollouts_are_of(6.0, SETTINGS))


def test_transitions_are_those_of_the_routes():
    route = made_route(3)
    seen = transitions([route], SETTINGS)
    assert len(seen) == len(route.decisions)
    assert all(a.after == b.state for a, b in pairwise(seen))
    assert sum(one.reward for one in seen) == pytest.approx(total(route, SETTINGS))
    assert [one.reward for one in seen] == [reward(one.came, SETTINGS.weights) for one in route.decisions]


@given(st.integers(0, 30), st.integers(0, 30))
def test_shares_are_wilsons(yes, no):
    of = yes + no
    found = share(yes, of)
    if of:
        expected = binomtest(yes, of).proportion_ci(0.95, "wilson")
        assert found == pytest.approx((yes / of, expected.low, expected.high), abs=1e-12)
    else:
        assert (found.low, found.high) == (0.0, 1.0)


def test_ratios_are_bootstrapped_as_scipy_does():
    rng = np.random.default_rng(5)
    metres = rng.uniform(2, 20, 40)
    times = 30 * metres + rng.normal(0, 60, 40)
    found = ratio(times.tolist(), metres.tolist())

    def of_sums(a, b, axis):
        return a.sum(axis) / b.sum(axis)

    theirs = bootstrap((times, metres), of_sums, paired=True, vectorized=True, method="percentile", rng=2)
    low, high = theirs.confidence_interval
    assert found.at == pytest.approx(times.sum() / metres.sum())
    assert found.low == pytest.approx(low, abs=0.1 * (high - low))
    assert found.high == pytest.approx(high, abs=0.1 * (high - low))
    assert np.isnan(ratio([1.0, 2.0], [0.0, 0.0]).at)
    assert mean([3.0, 3.0, 3.0]) == (3.0, 3.0, 3.0)


def test_figures_and_verdicts_say_what_was_won():
    routes = [made_route(seed) for seed in range(30)]
    better = [replace_last(route) for route in routes]
    told = figures(routes, SETTINGS)
    metres = sum(route.metres for route in routes)
    mishaps = sum(one.came.mishap != "" for route in routes for one in route.decisions)
    assert told["mishaps per 100 m"].at == pytest.approx(100 * mishaps / metres)
    assert told["planning per metre [s]"].at == pytest.approx(sum(route.planning for route in routes) / metres)
    assert told["share that arrives"].at == sum(route.ended == ARRIVED for route in routes) / 30
    same = dict.fromkeys(choosers.NAMES, routes)
    assert all(said.endswith("no gain is shown") for said in verdicts(same, SETTINGS))
    won = verdicts({**same, choosers.LEARNED: better}, SETTINGS)
    assert all(said.endswith("learning gives more") for said in won)
    lost = verdicts({**same, choosers.THRESHOLD: better}, SETTINGS)
    others = [name for name in choosers.NAMES if name != choosers.LEARNED]
    less = [name for name, said in zip(others, lost, strict=True) if said.endswith("learning gives less")]
    assert less == [choosers.THRESHOLD]


def replace_last(route: Route) -> Route:
    """The same with half a metre more at its end."""
    last = route.decisions[-1]
    more = replace(last, came=replace(last.came, distance=last.came.distance + 0.5))
    return replace(route, decisions=(*route.decisions[:-1], more))


def test_what_was_tried_is_told_by_action():
    routes = [made_route(seed) for seed in range(20)]
    lines = dict(line.split(": ", 1) for line in tried(routes))
    assert set(lines) == set(ACTIONS)
    came = [one.came for route in routes for one in route.decisions if one.action == TRIPOD]
    refused = sum(one.refused for one in came) / len(came)
    pace = sum(one.time for one in came) / sum(one.distance for one in came)
    assert lines[TRIPOD].startswith(f"{len(came)} iterations; refused {refused:.2f} (")
    assert f"; {pace:.2f} (" in lines[TRIPOD]


def test_rules_that_are_compared_with():
    assert [choosers.chooser(f"always {action}", None)(Features(0.1)) for action in (WAVE, TRIPOD, WALK)] == [
        WAVE,
        TRIPOD,
        WALK,
    ]
    rule = choosers.chooser(choosers.THRESHOLD, None)
    assert [rule(Features(one)) for one in (0.0, 0.1, 0.9)] == [WALK, WAVE, TRIPOD]
    assert rule(Features(0.9, refused=True)) == WALK
    holds = choosers.chooser(choosers.HOLDS, None)
    assert [holds(Features(one, refused=refused)) for one in (0.0, 0.9) for refused in (False, True)] == [
        WAVE,
        WALK,
        WAVE,
        WALK,
    ]
    for name in (choosers.LEARNED, choosers.LEARNED_COMMANDED):
        with pytest.raises(ValueError, match="needs a policy"):
            choosers.chooser(name, None)


def test_of_a_table_what_is_commanded_is_its_best_that_moves_one_foot_at_a_time():
    worth = {TRIPOD: 1.0, WAVE: 0.0, WALK: -1.0}
    states = range(SETTINGS.space.size)
    seen = [SeenTransition(one, ACTIONS.index(name), reward, one) for one in states for name, reward in worth.items()]
    policy = learned(seen, SETTINGS, "0" * 32, 1)
    choose = choosers.chooser(choosers.LEARNED_COMMANDED, policy)
    assert policy.choose(Features(0.9)) == TRIPOD
    assert (choose(Features(0.9)), choose(Features(0.9, refused=True))) == (WAVE, WALK)


@pytest.mark.parametrize("seed", range(len(FAMILIES)))
def test_grounds_are_made_of_their_seed(seed):
    one, again, next_one = ground(seed, 4.0), ground(seed, 4.0), ground(seed + len(FAMILIES), 4.0)
    assert family(seed) == family(seed + len(FAMILIES))
    assert one.name.startswith(family(seed))
    assert one.digest == again.digest
    assert one.heights.tobytes() != next_one.heights.tobytes()
    west, south, east, north = one.geometry.bounds
    assert (west, east) == pytest.approx((-8.0, 8.0))
    assert (south, north) == pytest.approx((-6.0, 6.0))
    assert np.isfinite(one.heights).all()


def steep(size: float):
    """A square map of a plane that rises by 0.3 towards north-east."""
    x, y = np.meshgrid(*2 * [np.arange(0.0, size + 0.1, 0.25)])
    return from_heights((0.3 * (x + y) / np.sqrt(2)).astype(np.float32), 0.25, 500.0, -40.0, "steep")


@pytest.mark.parametrize("seed", range(4))
def test_a_part_of_a_map_is_the_map_turned_and_moved(seed):
    """A plane stays one, as steep, whichever way its part is turned."""
    part = part_of(steep(40.0), seed, 5.0)
    assert part.geometry.bounds == pytest.approx((-2.5 - AROUND, -AROUND, 2.5 + AROUND, AROUND))
    x, y = np.meshgrid(part.geometry.xs, part.geometry.ys)
    (east, north, _), (off, *_), *_ = np.linalg.lstsq(
        np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3), part.heights.ravel(), rcond=None
    )
    assert np.hypot(east, north) == pytest.approx(0.3, abs=1e-5)
    assert off < 1e-6
    assert part.digest == part_of(steep(40.0), seed, 5.0).digest
    other = part_of(steep(40.0), seed + 1, 5.0)
    assert part.heights.tobytes() != other.heights.tobytes()


def test_a_map_without_so_much_known_ground_is_refused():
    with pytest.raises(InvalidInput, match="no part of 18 × 8 m is known; take shorter routes"):
        part_of(steep(15.0), 1, 10.0)


def test_the_table_that_ships_fits_the_default_robot_and_is_learned_as_the_command_does():
    shipped = shipped_policy(robot().digest)
    assert shipped is not None
    require_made_for(shipped, robot().digest, SHIPPED_SETTINGS)
    # what is chosen after an iteration that held was tried more than once or twice
    chosen = shipped.visits[np.arange(len(shipped.visits)), shipped.choices]
    assert np.median(chosen[chosen > 0]) >= 5
    assert shipped.seeds >= 200
    assert shipped_policy("0" * 32) is None


def test_no_ground_is_both_learned_from_and_compared_on():
    assert not set(LEARNED) & set(UNSEEN)
