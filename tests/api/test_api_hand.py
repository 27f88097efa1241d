"""What is in hand over REST: moved without a trace, told to every listener, chosen by one event; and who did it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import InvalidInput
from footfall.planning.body.body_shift import BodyShift
from tests.support.problems import problem

LEG = 2
HERE = "/sessions/current"


@pytest.fixture
def chosen(standing):
    """A client of a server with a footfall chosen near a wheel; where that is."""
    state = standing.get("/robot").json()
    hip = np.array(state["T_base_hips"][LEG])[:2, 3]
    x, y = (float(one) for one in hip * (1 + 1.2 / np.hypot(*hip)))
    standing.post(f"{HERE}/footfalls", json={"leg": LEG, "x": x, "y": y}).raise_for_status()
    return standing, x, y


def log(client):
    return client.get(f"{HERE}/log").json()["events"]


def test_a_footfall_is_moved_without_a_trace_and_chosen_once(chosen):
    client, x, y = chosen
    before = len(log(client))
    taken = client.put(f"{HERE}/hand", json={"what": "footfall"}).json()["hand"]
    assert (taken["place"], taken["moved"], taken["leg"]) == ([x, y], False, LEG)
    for step in range(1, 6):
        moved = client.put(f"{HERE}/hand", json={"what": "footfall", "place": [x + 0.02 * step, y]}).json()["hand"]
    assert moved["moved"] is True
    assert f"{0.1:.3f} m from where it was" in moved["read"]["text"]
    assert len(log(client)) == before
    assert client.get(HERE).json()["footfall"]["x"] == x
    # what is told of the place is what choosing it answers
    held = client.post(f"{HERE}/hand/commit").json()["hand"]
    answer = client.get(HERE).json()["footfall_answer"]
    assert (answer["x"], answer["y"]) == (x + 0.1, y)
    assert moved["read"]["good"] == answer["acceptable"]
    assert moved["read"]["reasons"] == answer["reasons"]
    assert (held["moved"], held["place"]) == (False, [x + 0.1, y])
    assert [event["type"] for event in log(client)[before:]] == ["footfall_chosen"]
    # put down, and taken back
    assert client.delete(f"{HERE}/hand").json() == {"hand": None}
    assert "nothing is in hand" in problem(client.post(f"{HERE}/hand/commit"), 409, "conflict")["detail"]
    turned = client.post(f"{HERE}/undo", json={}).json()
    assert turned["choice"]["kind"] == "footfall"
    assert client.get(HERE).json()["footfall"] == {"leg": LEG, "x": x, "y": y}
    assert turned["redo"] == turned["choice"]


def test_what_was_moved_and_put_down_is_where_it_was(chosen):
    client, x, y = chosen
    before = len(log(client))
    client.put(f"{HERE}/hand", json={"what": "footfall", "place": [x + 1, y]}).raise_for_status()
    client.delete(f"{HERE}/hand").raise_for_status()
    assert client.get(HERE).json()["footfall"]["x"] == x
    # let go where it was taken up: nothing was chosen
    client.put(f"{HERE}/hand", json={"what": "footfall"}).raise_for_status()
    client.post(f"{HERE}/hand/commit").raise_for_status()
    assert len(log(client)) == before
    # somebody chooses another: it is in hand there
    client.put(f"{HERE}/hand", json={"what": "footfall", "place": [x + 1, y]}).raise_for_status()
    client.post(f"{HERE}/footfalls", json={"leg": LEG, "x": x, "y": y + 0.1}).raise_for_status()
    held = client.get(f"{HERE}/hand").json()["hand"]
    assert (held["place"], held["moved"]) == ([x, y + 0.1], False)
    client.delete(f"{HERE}/hand").raise_for_status()


def test_a_point_is_read_against_ground_and_hip(chosen):
    client, x, y = chosen
    client.put(f"{HERE}/points", json={"leg": LEG, "points": [[x, y, 1.2], [x, y, 1.3]]}).raise_for_status()
    ground = client.get(HERE).json()["footfall_answer"]["z"]
    radius = client.get("/robot").json()["wheel_radius"]
    in_ground = client.put(f"{HERE}/hand", json={"what": "point", "index": 1, "place": [x, y, ground]}).json()["hand"]
    assert in_ground["read"]["good"] is False
    assert f"the wheel would be {radius:.3f} m in the ground" in in_ground["read"]["reasons"]
    far = client.put(f"{HERE}/hand", json={"what": "point", "index": 1, "place": [x, y, 9.0]}).json()["hand"]
    assert any("from the hip" in reason for reason in far["read"]["reasons"])
    client.post(f"{HERE}/hand/commit").raise_for_status()
    assert client.get(HERE).json()["points"]["points"] == [[x, y, 1.2], [x, y, 9.0]]
    client.post(f"{HERE}/undo", json={}).raise_for_status()
    assert client.get(HERE).json()["points"]["points"][1] == [x, y, 1.3]
    none = problem(client.put(f"{HERE}/hand", json={"what": "point", "index": 2}), 409, "conflict")
    assert "no point 3" in none["detail"]
    client.put(f"{HERE}/points", json={"leg": LEG, "points": []}).raise_for_status()
    assert client.get(f"{HERE}/hand").json() == {"hand": None}


def test_the_chassis_is_read_as_it_goes_and_refused_with_the_leg(chosen):
    client, _, _ = chosen
    shift = [0.05, 0, -0.05, 0, 0, 0.02]
    moved = client.put(f"{HERE}/hand", json={"what": "chassis", "place": shift}).json()["hand"]
    assert moved["read"]["good"] is True
    assert client.get(HERE).json()["what_if"] is None
    held = client.post(f"{HERE}/hand/commit").json()["hand"]
    what_if = client.get(HERE).json()["what_if"]
    assert [what_if[name] for name in ("dx", "dy", "dz", "droll", "dpitch", "dyaw")] == shift
    assert held["place"] == pytest.approx(shift, abs=1e-9)
    # the read-out says the same as the what-if that is computed when it is let go
    far = client.put(f"{HERE}/hand", json={"what": "chassis", "place": [0, 0, 1.9, 0, 0, 0]}).json()["hand"]
    assert far["read"]["good"] is False
    told = problem(client.post(f"{HERE}/hand/commit"), 422, "invalid-input")
    assert told["leg"] in range(6)
    assert [told["detail"]] == far["read"]["reasons"]
    back = client.get(f"{HERE}/hand").json()["hand"]
    assert back["refused"] == told["detail"]
    assert back["place"] == held["place"]
    assert client.get(HERE).json()["what_if"] == what_if
    # back to where the rover stands: the what-if ends
    client.put(f"{HERE}/hand", json={"what": "chassis", "place": [0] * 6}).raise_for_status()
    client.post(f"{HERE}/hand/commit").raise_for_status()
    assert client.get(HERE).json()["what_if"] is None
    client.delete(f"{HERE}/hand").raise_for_status()


@pytest.mark.parametrize(
    ("body", "status", "kind"),
    [
        ({"what": "rover"}, 422, "validation"),
        ({"what": "footfall", "place": [1, 2, 3]}, 422, "invalid-input"),
        ({"what": "point", "place": [1, 2]}, 422, "invalid-input"),
        ({"what": "chassis", "place": [0, 0, 77, 0, 0, 0]}, 422, "invalid-input"),
        ({"what": "footfall", "place": [True, 2]}, 422, "validation"),
    ],
)
def test_what_makes_no_sense_is_refused_and_the_hand_stays(chosen, body, status, kind):
    client, x, y = chosen
    held = client.put(f"{HERE}/hand", json={"what": "footfall", "place": [x + 0.1, y]}).json()
    problem(client.put(f"{HERE}/hand", json=body), status, kind)
    assert client.get(f"{HERE}/hand").json() == held
    client.delete(f"{HERE}/hand").raise_for_status()


@given(
    st.tuples(*[st.floats(-2, 2)] * 3),
    st.tuples(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3)),
    st.tuples(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3)),
)
def test_the_shift_between_two_poses_leads_from_one_to_the_other(moved, turned, stood):
    T = BodyShift(0, 0, 0, *stood).applied(np.eye(4))
    shift = BodyShift(*moved, *turned)
    found = BodyShift.between(T, shift.applied(T))
    assert found.vector[:3] == pytest.approx(moved, abs=1e-12)
    assert np.abs(found.applied(T) - shift.applied(T)).max() < 1e-9
    assert found.vector[3:] == pytest.approx(turned, abs=1e-6) or abs(turned[1]) > math.pi / 2 - 0.01


def test_a_shift_that_is_too_far_is_none():
    T = np.eye(4)
    T[0, 3] = 6.0
    with pytest.raises(InvalidInput, match="at most 5 m"):
        BodyShift.between(np.eye(4), T)
