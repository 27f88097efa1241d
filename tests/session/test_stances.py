"""What if the chassis stood elsewhere: planned from, ended, moved to, replayed, and never sent."""

import json
from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import CommandRefused, Conflict, InvalidBundle, InvalidInput
from footfall.planning.answers import Status
from footfall.planning.body.body_shift import BodyShift, PredictedState, ShiftRefused
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.shift import shifted_state
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import wheel_centers
from footfall.session.jobs.local import InlineJobs
from footfall.session.log.event import next_event
from footfall.session.log.fold import fold, fold_all
from footfall.session.products.kinds import BODY_MOVE, SHIFT
from footfall.session.registry import Sessions
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import TelemetryFrame

LEG = 2
LOWER = BodyShift(dz=-0.3)
ASIDE = BodyShift(dx=0.05, dz=-0.1)


def near(athlete, standing):
    """A point beside the wheel that it can step to."""
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    return float(x + 0.1), float(y + 0.1)


def feet(athlete, state):
    points = wheel_centers(athlete, state.posture)
    return points @ state.T_site_base[:3, :3].T + state.T_site_base[:3, 3]


def test_a_what_if_is_planned_from_until_it_is_ended(live, athlete, standing):
    digest = live.stances.what_if(LOWER)
    shifted = live.get(digest)
    assert isinstance(shifted, PredictedState)
    assert live.state.state == digest
    assert live.state.what_if == standing.digest
    np.testing.assert_allclose(shifted.T_site_base, LOWER.applied(standing.T_site_base))
    np.testing.assert_allclose(feet(athlete, shifted), feet(athlete, standing), atol=1e-3)
    assert live.summary()["what_if"] == {"dx": 0.0, "dy": 0.0, "dz": -0.3, "droll": 0.0, "dpitch": 0.0, "dyaw": 0.0}

    maps = live.maps.compute(LEG).finish()
    assert live.get(maps).provenance.parents["state"] == digest
    assert live.fits.of_maps(LEG).fits
    assert live.stances.end_what_if() == standing.digest == live.state.state
    assert live.state.what_if is None
    assert live.summary()["what_if"] is None
    assert not live.fits.of_maps(LEG).fits
    with pytest.raises(Conflict, match="no what-if"):
        live.stances.end_what_if()


def test_a_shift_counts_from_how_the_rover_stands(live, athlete, dem, standing):
    alone = shifted_state(athlete, dem, standing, ASIDE)
    assert isinstance(alone, PredictedState)
    first = live.stances.what_if(LOWER)
    assert live.stances.what_if(ASIDE) == alone.digest != first
    assert live.state.what_if == standing.digest
    # the same in a search for a shift, and in a move: both are made of where the rover stands
    found = live.get(live.stances.find_shift(LEG, near(athlete, standing)).finish())
    moved = live.get(live.stances.plan_body_move(ASIDE).finish())
    assert found.provenance.parents["state"] == moved.provenance.parents["state"] == standing.digest
    assert (moved.status, live.state.newest(BODY_MOVE)) == (Status.FOUND, moved.digest)
    np.testing.assert_array_equal(moved.plan.waypoints[0], standing.posture)
    np.testing.assert_allclose(moved.plan.waypoints[-1], alone.posture, atol=1e-9)


def test_the_shift_that_makes_a_footfall_possible_can_be_tried_and_moved_to(live, athlete, dem, standing):
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    target = (float(x) - 0.5, float(y) + 0.4)
    live.maps.choose_footfall(LEG, *target)
    result = live.get(live.stances.find_shift(LEG).finish())
    assert (result.status, live.state.newest(SHIFT)) == (Status.FOUND, result.digest)
    assert (result.footfall.x, result.footfall.y) == target
    assert result.cost > 0.1
    # from where the rover stands the step is refused, after the shift it is not
    before = live.get(live.plans.step(LEG).finish())
    assert before.status is not Status.FOUND
    live.stances.what_if(result.shift)
    assert live.get(live.plans.step(LEG).finish()).status is Status.FOUND
    move = live.get(live.stances.plan_body_move(result.shift, result.plan.provenance.settings).finish())
    assert move.status is Status.FOUND
    np.testing.assert_array_equal(move.plan.waypoints, result.plan.waypoints)


def test_a_refused_what_if_names_leg_and_joint_and_changes_nothing(live, athlete, dem, standing):
    rng = np.random.default_rng(0)
    for _ in range(300):
        draw = rng.uniform(-1, 1, 6) * (0.3, 0.3, 0.5, 0.15, 0.15, 0.3) - (0, 0, 0.6, 0, 0, 0)
        shift = BodyShift(*map(float, draw))
        no = shifted_state(athlete, dem, standing, shift)
        if isinstance(no, ShiftRefused) and no.joint:
            break
    else:
        raise AssertionError("no shift in 300 turns a joint past its limit")
    live.stances.what_if(LOWER)
    before = live.state
    with pytest.raises(InvalidInput) as caught:
        live.stances.what_if(shift)
    assert caught.value.details == {"leg": no.leg, "joint": no.joint, "excess": no.excess}
    assert no.joint in caught.value.message
    assert live.state is before
    with pytest.raises(InvalidInput, match=r"leg \d is .* m too short") as caught:
        live.stances.what_if(BodyShift(dx=0.6))
    assert caught.value.details["leg"] in athlete.legs
    assert caught.value.details["joint"] == ""


def test_what_was_asked_is_folded_and_replays_to_the_same_digests(live, athlete, standing):
    live.stances.what_if(LOWER)
    live.stances.what_if(ASIDE)
    live.stances.end_what_if()
    live.stances.find_shift(LEG, near(athlete, standing)).finish()
    live.stances.plan_body_move(ASIDE).finish()
    live.stances.plan_body_move(BodyShift(dx=0.6)).finish()
    live.stances.what_if(LOWER)
    assert fold_all(live.events()).digest == live.state.digest
    report = replay(live.export_bundle())
    assert report.ok, report.problems
    kinds = ["what_if", "what_if", "shift", "body_move", "body_move", "what_if"]
    assert [(product.kind, product.verdict) for product in report.products] == [(kind, "same") for kind in kinds]
    assert report.state is not None
    assert report.state.digest == live.state.digest
    assert live.get(live.state.newest(BODY_MOVE)).status is not Status.FOUND
    json.dumps(live.summary(), allow_nan=False)


def test_a_reopened_session_is_still_in_its_what_if(tmp_path, athlete, dem, standing):
    for _ in range(2):
        with Sessions(tmp_path / "again", jobs=InlineJobs(), robot=athlete) as sessions:
            if not sessions.list():
                made = sessions.create("again")
                made.terrains.load(dem)
                made.stances.set(standing)
                made.stances.what_if(LOWER)
            else:
                again = sessions.open(sessions.list()[0]["id"])
                assert again.state.what_if == standing.digest
                asked = again.summary()["what_if"]
                assert asked is not None
                assert asked["dz"] == -0.3
                assert again.stances.end_what_if() == standing.digest


def test_a_plan_from_a_what_if_is_never_sent(live, athlete, standing):
    """The gate refuses it: the rover does not stand where it starts."""
    sent = []
    live.rover.connected(sent.append)
    live.rover.take_telemetry(TelemetryFrame(0, standing, standing.posture))
    live.stances.what_if(LOWER)
    assert live.get(live.plans.step(LEG, near(athlete, standing)).finish()).status is Status.FOUND
    live.sequences.make()
    # planning may have taken longer than telemetry counts as new
    live.rover.take_telemetry(TelemetryFrame(1, replace(standing, time=1.0), standing.posture))
    assert live.review.plan_matches_rover()["ok"] is False
    with pytest.raises(CommandRefused) as caught:
        live.commands.arm()
    assert caught.value.details["check"] == "start"
    assert caught.value.details["joint"] in athlete.joint_names
    live.stances.end_what_if()
    with pytest.raises(CommandRefused):
        live.commands.arm()
    assert sent == []
    # the same step from how the rover stands is no trouble
    live.plans.step(LEG, near(athlete, standing)).finish()
    live.sequences.make()
    live.rover.take_telemetry(TelemetryFrame(2, replace(standing, time=2.0), standing.posture))
    assert live.commands.arm()["token"]


def test_freezing_the_rover_ends_a_what_if(live, standing):
    live.stances.what_if(LOWER)
    live.rover.take_telemetry(TelemetryFrame(0, standing, standing.posture))
    assert live.stances.freeze() == standing.digest
    assert live.state.what_if is None


def test_an_end_that_does_not_fit_the_log_is_refused(live):
    for _ in range(2):
        with pytest.raises(InvalidBundle, match="what-if"):
            fold(live.state, next_event(live.events()[-1], 9e9, "what_if_ended", {"digest": "0" * 32}))
        live.stances.what_if(LOWER)


def test_what_is_missing_or_wrong_is_said(live, athlete):
    with pytest.raises(Conflict, match="no footfall is chosen"):
        live.stances.find_shift(LEG)
    with pytest.raises(InvalidInput, match="legs 0…5"):
        live.stances.find_shift(9, (0.0, 0.0))
    with pytest.raises(InvalidInput, match="time_limit"):
        live.stances.find_shift(LEG, (0.0, 0.0), FindShiftSettings(time_limit=0.0))
    off = live.get(live.stances.find_shift(LEG, (90.0, 90.0)).finish())
    assert off.status is Status.OFF_MAP
    assert off.reason
