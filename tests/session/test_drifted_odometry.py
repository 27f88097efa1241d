"""Odometry that drifts, and images that took it back: gate, walk and page go by the pose on the map, or refuse."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import CommandRefused, Conflict
from footfall.core.frames import rotation, transform
from footfall.planning.walk.problem import WalkGoal, WalkSettings
from footfall.planning.walk.smoothing import Smoothing
from footfall.telemetry.state import TelemetryFrame
from tests.support.drifted import looked_twice
from tests.support.waiting import BOUND

DRIFT = transform(rotation("z", np.array(0.005)), (0.06, -0.02, 0.0))
"""More than the gate accepts, less than three deviations of one look."""
GOAL, SETTINGS = WalkGoal(0.4, 0.1), WalkSettings(seed=1, time_limit=BOUND, smoothing=Smoothing(rounds=0))


@pytest.fixture
def bare(standing):
    """Nothing is known of what it bears: it is taken as rigid."""
    return replace(standing, wheel_forces=np.zeros_like(standing.wheel_forces), joint_torques=np.zeros(36))


@pytest.fixture
def hears(live):
    """hears(state): telemetry that has the rover so, and was just received."""
    live.rover.link._clock = lambda: 0.0
    live.rover.connected(lambda text: None)
    numbers = iter(range(1, 100))

    def hear(state):
        live.rover.take_telemetry(TelemetryFrame(next(numbers), state, state.posture))

    return hear


@pytest.fixture
def drifted(live, dem, bare, hears):
    """The rover as its odometry has it, and a walk that was planned from where it is on the map."""
    _, told = looked_twice(live, dem, bare, DRIFT)
    hears(told)
    live.stances.freeze()
    found = live.get(live.walks.plan(GOAL, SETTINGS).finish())
    assert found.plan is not None, found.reason
    return told


def test_a_walk_of_a_rover_whose_odometry_drifted_is_commanded_and_sent(live, bare, drifted):
    assert np.allclose(live.fits.place_on_map(drifted).state.T_site_base, bare.T_site_base)
    assert live.walks.walking().against == ""
    sequence = live.walks.command(None, 0)
    assert live.review.plan_matches_rover()["ok"] is True
    assert live.fits.up_to_date()["sequence"]["fits"]
    assert live.commands.send(live.commands.arm(sequence)["token"])["run"] == 1


def test_a_chassis_that_is_elsewhere_on_the_map_is_refused_though_odometry_has_it_there(live, bare, drifted, hears):
    sequence = live.walks.command(None, 0)
    hears(bare)  # as the walk begins, but of a rover that is 6 cm from where its odometry has it
    assert "chassis is 0.0" in live.walks.walking().against
    with pytest.raises(CommandRefused, match=r"the chassis has moved by 0\.0\d+ m") as refused:
        live.commands.arm(sequence)
    assert refused.value.details["check"] == "pose"
    assert live.review.plan_matches_rover()["ok"] is False


def test_a_correction_that_is_too_old_makes_no_refusal_into_a_pass(live, drifted, hears):
    sequence = live.walks.command(None, 0)
    hears(replace(drifted, time=drifted.time + 4 * 3600.0))
    with pytest.raises(
        CommandRefused, match=r"images of 240 min ago .* uncertain by 0\.0\d+ m .* take images"
    ) as refused:
        live.commands.arm(sequence)
    assert refused.value.details["check"] == "pose"
    assert "take images" in live.walks.walking().against
    assert "take images" in live.fits.up_to_date()["sequence"]["reason"]
    assert "take images" in live.review.plan_matches_rover()["reason"]
    with pytest.raises(Conflict, match=r"on the map and by odometry alone: the chassis is .* take images"):
        live.walks.command(None, 0)


def test_a_correction_of_a_map_from_elsewhere_makes_no_refusal_into_a_pass(live, dem, bare, drifted):
    live.terrains.load(replace(dem, correction=DRIFT, name="of another rover"))
    live.walks.plan(GOAL, SETTINGS).finish()
    assert "from no images of this rover" in live.walks.walking().against
    with pytest.raises(Conflict, match="from no images of this rover"):
        live.walks.command(None, 0)


def test_images_that_did_not_reach_the_map_make_its_correction_no_younger(live, dem, bare, drifted):
    moved = live.get(live.state.dem)
    later = replace(drifted, time=drifted.time + 4 * 3600.0)
    live.folded_log.record("snapshot_taken", {"digest": "c" * 32, "state": live.put(later), "pairs": []})
    unmoved = live.put(replace(moved, name="not aligned: too little common ground"))
    parents = {"robot": live.robot_digest, "snapshot": "c" * 32, "map": moved.digest}
    live.folded_log.record("product", {"kind": "terrain", "parents": parents, "settings": None, "digest": unmoved})
    assert live.fits.place_on_map(later).age == pytest.approx(4 * 3600.0)
    assert "images of 240 min ago" in live.fits.place_on_map(later).doubt
