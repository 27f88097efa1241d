"""Runs compared with their prediction: laws of the comparison, and the springs that tell how far loads may be off."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance
from footfall.planning.body.stand import stand
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.robot.kinematics import wheel_jacobian
from footfall.sequence.foretold import platform_of
from footfall.sequence.outcome import CHASSIS, Foretold, Outcome, Seen, compare
from footfall.terrain.generate import plane

LEGS = 6
LEG = 2
HUBS = np.array([(2 * np.cos(a), 2 * np.sin(a), 0.24) for a in np.arange(LEGS) * np.pi / 3])


def foretold(rigid=False, **changes):
    start, end = np.eye(4), np.eye(4)
    end[:3, 3] = (0.01, -0.02, -0.005)
    told = Foretold(
        rigid=rigid,
        start=start,
        end=end,
        stepped=(LEG,),
        hubs=HUBS,
        normals=np.tile((0.0, 0.0, 1.0), (LEGS, 1)),
        loads=np.full(LEGS, np.nan if rigid else 1400.0),
        touch_uncertainty=np.full(LEGS, 0.01),
        load_uncertainty=np.full(LEGS, np.nan if rigid else 100.0),
        drift_uncertainty=0.005,
        sink_uncertainty=0.004,
    )
    return replace(told, **changes)


def seen(told, hub=(0.0, 0.0), load=0.0, drift=(0.0, 0.0), sink=0.0):
    """The rover where it was predicted, but for so much of leg 2 and of the chassis."""
    hubs, forces, T = told.hubs.copy(), np.zeros((LEGS, 3)), told.end.copy()
    forces[:, 2] = 1400.0
    hubs[LEG, :2] += hub
    forces[LEG, 2] += load
    T[:3, 3] += (*drift, -sink)
    return Seen(T, hubs, forces)


def made(differences, rigid=False, sags: bool | None = True):
    return Outcome(1, 3, rigid, sags, differences, Provenance({}))


def by_name(differences):
    return {(one.quantity, one.leg): one for one in differences}


def test_what_goes_as_predicted_is_good():
    found = compare(foretold(), seen(foretold()))
    assert {one.verdict for one in found} == {"as_predicted"}
    assert [one.advice for one in found] == [""] * len(found)
    assert [one.quantity for one in found] == ["touch-down", *["load"] * LEGS, "drift", "sink"]
    assert made(found).verdict == "as_predicted"
    sink = by_name(found)["sink", CHASSIS]
    assert (sink.predicted, sink.measured) == pytest.approx((0.005, 0.005))
    assert by_name(found)["drift", CHASSIS].predicted == pytest.approx(np.hypot(0.01, 0.02))


part = st.floats(-3.0, 3.0).filter(lambda x: abs(abs(x) - 1.0) > 1e-6)


@given(hub=part, load=part, drift=part, sink=part, turn=st.floats(0.0, 6.0))
def test_a_quantity_differs_just_where_it_is_off_by_more_than_its_uncertainty(hub, load, drift, sink, turn):
    told = foretold()
    way = np.array([np.cos(turn), np.sin(turn)])
    now = seen(told, hub * 0.01 * way, load * 100.0, drift * 0.005 * way, sink * 0.004)
    found = by_name(compare(told, now))
    for key, times in {
        ("touch-down", LEG): hub,
        ("load", LEG): load,
        ("drift", CHASSIS): drift,
        ("sink", CHASSIS): sink,
    }.items():
        assert (found[key].verdict == "differs") == (abs(times) > 1), key
        assert bool(found[key].advice) == (abs(times) > 1)
    assert found["load", LEG].difference == pytest.approx(100.0 * load, abs=1e-9)
    assert found["sink", CHASSIS].difference == pytest.approx(0.004 * sink, abs=1e-12)
    bad = any(abs(times) > 1 for times in (hub, load, drift, sink))
    assert made(tuple(found.values())).verdict == ("differs" if bad else "as_predicted")


@given(st.floats(-500.0, 500.0), st.floats(0.0, 300.0), st.floats(0.0, 300.0))
def test_more_doubt_never_makes_more_differences(load, less, more):
    less, more = sorted((less, more))
    told = foretold()
    sure, unsure = (
        by_name(compare(replace(told, load_uncertainty=np.full(LEGS, width)), seen(told, load=load)))["load", LEG]
        for width in (less, more)
    )
    assert not (unsure.verdict == "differs" and sure.verdict == "as_predicted")


def test_what_is_not_known_is_never_good():
    told = foretold()
    blind = compare(told, replace(seen(told), forces=None))
    assert {one.verdict for one in blind if one.quantity == "load"} == {"not_told"}
    assert "not measured" in by_name(blind)["load", 0].text
    assert made(blind).verdict == "not_told"
    assert made(()).verdict == "not_told"
    # commands that take the rover as rigid: good only of a rover that is
    rigid = compare(foretold(rigid=True), seen(told))
    assert {one.verdict for one in rigid if one.quantity == "load"} == {"not_told"}
    assert [made(rigid, True, sags).verdict for sags in (True, None, False)] == ["not_told", "not_told", "as_predicted"]
    sank = compare(foretold(rigid=True), seen(told, sink=0.05))
    assert {made(sank, True, sags).verdict for sags in (True, None, False)} == {"differs"}
    assert "with the pose held" in by_name(sank)["sink", CHASSIS].advice


def test_the_numbers_are_told():
    told = foretold()
    found = by_name(compare(told, seen(told, (0.03, 0.04), -1023.0, (0.2, 0.0), 0.09)))
    assert found["load", LEG].text == "leg 2 bears 377 N, predicted 1400 ± 100 N"
    assert found["touch-down", LEG].text == "leg 2 stands 50.0 ± 10.0 mm from where it was predicted"
    assert found["sink", CHASSIS].text == "the chassis sank by 95.0 mm, predicted 5.0 ± 4.0 mm"
    assert "moved by 211.0 mm, predicted 22.4 mm: it is 200.0 ± 5.0 mm" in found["drift", CHASSIS].text
    with pytest.raises(InvalidInput, match="a verdict is one of"):
        replace(found["load", LEG], verdict="fine")


@pytest.mark.parametrize("leg", [0, 2])
def test_higher_ground_moves_loads_as_springs_say(athlete, leg):
    """A second method: the whole rover settles anew, the ground under one wheel higher by 4 mm."""
    rover = CompliantRover(athlete, plane(size=10.0, resolution=0.1))
    stood = stand(athlete, rover.dem)
    rest = rover.let_down(stood.posture, stood.T_site_base)
    lift = np.array([rest.T_site_base[:3, :3] @ wheel_jacobian(athlete, rest.posture, one) for one in athlete.legs])
    platform = platform_of(athlete, rest, lift)
    # forces of springs are in balance whatever the ground does
    assert np.abs(platform.loads.sum(axis=0)).max() < 1e-6
    assert platform.loads == pytest.approx(platform.loads.T, abs=1e-6)
    height = 0.004
    higher = replace(rest, raised=rest.raised + height * np.eye(LEGS)[leg])
    again = rover.after(higher, rest.commanded)
    assert again.settled
    change = again.loads - rest.loads
    expected = height * platform.loads[:, leg]
    assert 30 < change[leg] < 240  # the wheel alone would give 240 N
    assert change == pytest.approx(expected, abs=0.25 * float(change[leg]))
    moved = again.T_site_base[:3, 3] - rest.T_site_base[:3, 3]
    assert moved[2] == pytest.approx(height * platform.rise[leg], rel=0.05)
    assert np.hypot(*moved[:2]) == pytest.approx(height * platform.sway[leg], rel=0.2)
