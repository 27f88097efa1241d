"""What was made is compared with how things are now: one law for all products, in words, live and in replay."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.frames import rotation
from footfall.planning.body.body_shift import BodyShift
from footfall.robot.ik import contact_point
from footfall.robot.tolerance import JOINT_TOLERANCE
from footfall.session.gate.checks import POSE_TOLERANCE, START_TOLERANCE
from footfall.session.log.fold import fold_all
from footfall.session.products.kinds import (
    BODY_MOVE,
    EXECUTION,
    KINDS,
    MAPS,
    PLAN,
    ROUTE,
    SEQUENCE,
    SHIFT,
    WALK,
    LooksAt,
)
from footfall.session.products.up_to_date import PLACE_TOLERANCE, Fit, OtherGround, Present
from footfall.session.replay.recompute import replay
from footfall.telemetry.state import RobotState, TelemetryFrame

LEG = 2
STANDS = RobotState("r", 0.0, np.zeros(12), np.eye(4), np.full((2, 3), 50.0), np.zeros(12), "idle")
NAMES = tuple(f"joint{i}" for i in range(12))
PARENTS = {"robot": "r1", "dem": "d1", "state": "s1"}
SAMPLED = st.sampled_from([MAPS, PLAN, EXECUTION, SHIFT, BODY_MOVE, SEQUENCE, WALK])


def otherwise(state=STANDS, turned=0.0, east=0.0, yaw=0.0, load=1.0):
    T = state.T_site_base.copy()
    T[0, 3] += east
    T[:3, :3] = rotation("z", yaw)[:3, :3] @ T[:3, :3]
    posture = state.posture.copy()
    posture[7] += turned
    return replace(state, posture=posture, T_site_base=T, wheel_forces=state.wheel_forces * load, time=9.0)


def now(stands: RobotState | None = STANDS, **about):
    return Present("r1", "d1", stands, NAMES, **about)


@given(SAMPLED, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_what_moved_less_than_may_be_measured_fits_and_what_moved_more_than_may_be_sent_does_not(kind, share, way):
    """Between the two what is judged cell by cell does not fit, and what is to be sent does."""
    small = otherwise(turned=0.9 * share * JOINT_TOLERANCE, east=0.9 * way * PLACE_TOLERANCE)
    assert now(small).fit(kind, PARENTS, STANDS).fits
    sign = 1.0 if way >= 0 else -1.0
    between = otherwise(turned=sign * 0.5 * START_TOLERANCE)
    assert now(between).fit(kind, PARENTS, STANDS).fits == (kind is not MAPS)
    for large in (otherwise(turned=sign * 1.1 * START_TOLERANCE), otherwise(east=sign * 1.1 * POSE_TOLERANCE)):
        found = now(large).fit(kind, PARENTS, STANDS)
        assert not found.fits
        assert found.reason.startswith("the rover moved since: ")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"east": 0.12}, "its chassis by 0.120 m"),
        ({"yaw": 0.1}, "its chassis by 0.100 m"),
        ({"turned": 0.1}, r"joint7 by +5.73°"),
        ({"load": 1.5}, "its wheels bear 260 N, +50%"),
    ],
)
def test_the_reason_says_what_moved_and_by_how_much(change, words):
    assert now(otherwise(**change)).fit(MAPS, PARENTS, STANDS).reason == f"the rover moved since: {words}"


def test_other_ground_and_another_robot_are_named():
    assert now().fit(PLAN, {**PARENTS, "dem": "d0"}, STANDS).reason == "the terrain has changed since"
    assert now().fit(PLAN, {**PARENTS, "robot": "r0"}, STANDS).reason == "it was made for another robot"
    assert now(None).fit(PLAN, PARENTS, STANDS).reason == "nothing is known of how the rover stands"
    assert now().fit(PLAN, PARENTS, STANDS).fits


@given(st.sampled_from(list(KINDS.values())), st.floats(0.0, 9.0), st.booleans(), st.floats(0.0, 0.3))
def test_newer_ground_leaves_only_what_looked_at_none_that_changed(kind, area, everywhere, east):
    older = {**PARENTS, "dem": "d0"}
    ground = OtherGround(area, 0.0, 0.1, everywhere)
    moved = now(otherwise(east=east))
    stance, found = moved.fit(kind, PARENTS, STANDS), moved.fit(kind, older, STANDS, ground=ground)
    compared = kind.looks_at is not LooksAt.MAP
    assert found.fits == (compared and area == 0.0 and stance.fits)
    assert found.partly == (compared and area > 0.0 and not everywhere and kind.for_cells and stance.fits)
    # nobody knows of the ground: it may be any
    assert not moved.fit(kind, older, STANDS).fits
    # on the map that it was made on the ground is not asked
    assert moved.fit(kind, PARENTS, STANDS, ground=ground) == stance


def test_commands_are_of_one_map():
    assert {kind.looks_at for kind in KINDS.values() if kind.is_commands} == {LooksAt.MAP}


@pytest.mark.parametrize(
    ("ground", "words"),
    [
        (OtherGround(0.42, 0.0, 0.312), "by up to 0.31 m on 0.42 m² that it looked at"),
        (OtherGround(0.42, 0.42, 0.0), "on 0.42 m² that it looked at, of which 0.42 m² became known or unknown"),
    ],
)
def test_the_reason_says_how_much_ground_changed(ground, words):
    found = now().fit(PLAN, {**PARENTS, "dem": "d0"}, STANDS, ground=ground)
    assert found.reason == f"the terrain has changed since: {words}"


@given(SAMPLED, st.booleans())
def test_of_a_rover_that_is_not_heard_nothing_is_fresh(kind, moved):
    stands = otherwise(east=0.2) if moved else STANDS
    heard, unheard = (now(stands, unheard=why).fit(kind, PARENTS, STANDS) for why in ("", "it was heard a day ago"))
    assert heard.fits == unheard.fits
    assert (heard.verdict, unheard.verdict) == (("differs", "differs") if moved else ("fresh", "unknown"))


@given(st.floats(0.1, 3.0), st.floats(0.5, 2.0))
def test_a_route_goes_by_the_chassis_alone(turned, load):
    assert now(otherwise(turned=turned, load=load)).fit(ROUTE, PARENTS, STANDS).fits
    assert not now(otherwise(east=1.1 * POSE_TOLERANCE)).fit(ROUTE, PARENTS, STANDS).fits


@given(SAMPLED)
def test_in_a_what_if_colours_are_of_its_stance_and_commands_of_the_rovers(kind):
    there = otherwise(east=0.2)
    asked = now(what_if=there, counts_from=STANDS)
    # a move of the chassis may be planned from a predicted end, and fits the what-if of that end
    assert asked.fit(kind, PARENTS, there, predicted=True).fits == (kind is not SEQUENCE)
    from_the_rover = kind in (SHIFT, BODY_MOVE, SEQUENCE)
    assert asked.fit(kind, PARENTS, there).fits == (not from_the_rover)
    assert asked.fit(kind, PARENTS, STANDS).fits == (kind is not MAPS)
    assert asked.what_if_fit() == Fit(True)
    # the rover moves, to elsewhere: what was asked is of a stance that is no more
    left = now(otherwise(east=0.5), what_if=there, counts_from=STANDS)
    assert not left.fit(kind, PARENTS, there, predicted=True).fits
    assert left.what_if_fit() == Fit(False, "the rover moved since: its chassis by 0.500 m")
    # it goes to where the what-if had it, which is ended: what was made for that is of how it stands
    assert now(there).fit(kind, PARENTS, there, predicted=True).fits
    elsewhere = now().fit(kind, PARENTS, there, predicted=True)
    assert elsewhere.reason == "it is for a what-if, and the rover stands elsewhere: its chassis by 0.200 m"


# -- a session -------------------------------------------------------------------------------------


def heard(live, number, state):
    live.rover.take_telemetry(TelemetryFrame(number, replace(state, time=float(number)), state.posture))


def near(athlete, standing):
    """A point beside the wheel that it can step to."""
    x, y, _ = contact_point(athlete, standing.posture, LEG, standing.T_site_base)
    return float(x + 0.1), float(y + 0.1)


def told(live):
    messages = []
    live.listen(messages.append)
    return lambda: [one["fits"] for one in messages if one["type"] == "fits"]


def test_every_product_is_told_of_until_the_rover_moves_and_again_when_it_is_back(live, athlete, standing):
    live.rover.connected(lambda text: None)
    heard(live, 0, standing)
    live.maps.compute(LEG).finish()
    live.plans.step(LEG, near(athlete, standing)).finish()
    live.sequences.make()
    live.stances.plan_body_move(BodyShift(dz=-0.05)).finish()
    made = ("plan", "body_move", "sequence")
    first = live.summary()["up_to_date"]
    assert first["measured"]
    assert first["what_if"] is first["execution"] is first["shift"] is None
    assert all(first[name]["fits"] for name in made)
    assert [(leg, fit["fits"], fit["reason"]) for leg, fit in first["maps"].items()] == [(str(LEG), True, "")]
    # the same stance frozen anew, with another clock and noise: nothing is out of date for that
    noisy = replace(standing, posture=standing.posture + 5e-4, time=50.0)
    fits = told(live)
    heard(live, 1, noisy)
    live.stances.set(noisy)
    assert live.state.state == noisy.digest
    assert live.summary()["maps_current"] == {str(LEG): True}
    assert live.maps.shown(LEG) is not None
    assert fits() == []
    # it moves, and nothing else happens
    heard(live, 2, otherwise(standing, east=0.12))
    (news,) = fits()
    assert news == live.summary()["up_to_date"]
    assert all(not news[name]["fits"] for name in made)
    assert not news["maps"][str(LEG)]["fits"]
    assert news["maps"][str(LEG)]["reason"] == "the rover moved since: its chassis by 0.120 m"
    assert live.maps.shown(LEG) is None
    assert "moved since" in live.maps.footfall_answer(live.get(live.state.plan).footfall)["reasons"][0]
    heard(live, 3, otherwise(standing, east=0.12))
    assert len(fits()) == 1
    heard(live, 4, standing)
    assert all(fits()[-1][name]["fits"] for name in made)
    assert live.maps.shown(LEG) is not None


def test_a_what_if_is_asked_of_how_the_rover_stands_now(live, standing):
    live.rover.connected(lambda text: None)
    moved = otherwise(standing, east=0.05)
    heard(live, 0, standing)
    live.stances.what_if(BodyShift(dz=-0.05))
    assert live.state.what_if == standing.digest
    heard(live, 1, moved)
    assert live.state.what_if == standing.digest
    assert not live.summary()["up_to_date"]["what_if"]["fits"]
    shifted = live.get(live.stances.what_if(BodyShift(dz=-0.1)))
    np.testing.assert_allclose(shifted.T_site_base[:3, 3], moved.T_site_base[:3, 3] + (0.0, 0.0, -0.1))
    assert live.summary()["up_to_date"]["what_if"]["fits"]
    for asked in (
        live.stances.find_shift(LEG, tuple(moved.T_site_base[:2, 3] + 1.5)),
        live.stances.plan_body_move(BodyShift(dz=-0.1)),
    ):
        frozen = live.get(asked.finish()).provenance.parents["state"]
        np.testing.assert_allclose(live.get(frozen).T_site_base, moved.T_site_base)
    assert replay(live.export_bundle()).ok


def test_a_what_if_that_the_rover_has_moved_to_ends(live, standing):
    live.rover.connected(lambda text: None)
    heard(live, 0, standing)
    shifted = live.get(live.stances.what_if(BodyShift(dz=-0.06)))
    # on its way, and at rest a little off where it stood: the question is open
    for number, state in enumerate((replace(shifted_as(standing, shifted), mode="moving"), otherwise(standing, 2e-3))):
        heard(live, 1 + number, state)
        assert live.state.what_if == standing.digest
    there = shifted_as(standing, shifted)
    heard(live, 3, there)
    assert live.state.what_if is None
    assert live.events()[-1].type == "state_frozen"
    assert live.get(live.state.state).digest == replace(there, time=3.0).digest
    assert fold_all(live.events()).digest == live.state.digest
    assert replay(live.export_bundle()).ok


def shifted_as(standing, shifted):
    return replace(standing, posture=shifted.posture, T_site_base=shifted.T_site_base)


def test_a_what_if_ends_with_the_run_that_was_to_end_there_also_where_the_rover_sagged(live, standing):
    commands = []
    live.rover.connected(lambda text: commands.append(json.loads(text)))
    heard(live, 0, standing)
    shift = BodyShift(dz=-0.06)
    live.sequences.make(live.stances.plan_body_move(shift).finish())
    shifted = live.get(live.stances.what_if(shift))
    heard(live, 1, standing)  # what came before it may be stale by now
    for command_id in live.commands.send(live.commands.arm()["token"])["commands"]:
        assert commands[-1]["id"] == command_id
        live.rover.take_acknowledgement(command_id, "done")
    assert live.state.what_if == standing.digest  # nobody has heard yet how it stands there
    sagged = otherwise(shifted_as(standing, shifted), turned=3 * START_TOLERANCE)
    heard(live, 2, sagged)
    assert live.state.what_if is None
    np.testing.assert_array_equal(live.get(live.state.state).posture, sagged.posture)
    # what is asked after the run is not ended by it, wherever the rover goes
    live.stances.what_if(shift)
    heard(live, 3, otherwise(sagged, turned=0.2))
    assert live.state.what_if is not None
    assert fold_all(live.events()).digest == live.state.digest
    assert replay(live.export_bundle()).ok
