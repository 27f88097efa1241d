"""What telemetry's plots read of joints that turn and slide, and the foot moves of walks; without a browser."""

from tests.browser.test_next_thing import of_page

CHANNELS = """
    const { startSamples, allChannels } = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map((robot) => { startSamples(robot); return allChannels(); })));
"""
FOOT_MOVES = """
    const { asPanelsRead } = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map(asPanelsRead)));
"""


def test_joints_that_turn_are_read_in_degrees_and_those_that_slide_in_metres():
    robot = {
        "legs": [0, 1],
        "joint_names": ["yaw", "out", "hip"],
        "leg_joints": [[0, 1], [2]],
        "joint_units": ["rad", "m", "rad"],
        "lower": [None, 0.1, 0.0],
        "upper": [None, 0.5, 3.141592653589793],
        "torque_limits": [None, 20.0, 5.0],
        "least_load": 0.005,
    }
    (channels,) = of_page(CHANNELS, "samples.js", [robot])
    of = {quantity: [one for one in channels if one["quantity"] == quantity] for quantity in ("position", "torque")}
    assert [one["leg"] for one in of["position"]] == [0, 0, 1]
    assert [one["unit"] for one in of["position"]] == ["°", "m", "°"]
    assert [(one["low"], one["high"]) for one in of["position"]] == [(None, None), (0.1, 0.5), (0.0, 180.0)]
    assert [one["unit"] for one in of["torque"]] == ["N·m", "N", "N·m"]
    assert [(one["low"], one["high"]) for one in of["torque"]] == [(None, None), (-20.0, 20.0), (-5.0, 5.0)]


def test_waypoints_of_a_described_walk_go_to_their_foot_moves():
    phases = ["body", "lift", "swing", "lower", "lower", "lift", "lower", "body"]
    answer = {"plan": {"phases": phases, "moves": [3, 1]}, "partial": None, "refused": [["support", 4]]}
    (read,) = of_page(FOOT_MOVES, "legged.js", [answer])
    assert read["plan"]["moves"] == [0, 0, 0, 0, 0, 1, 1, 2]
    assert read["plan"]["legs"] == [3, 1]
    assert read["partial"] is None
    assert read["blocked"] == [{"check_name": "support", "count": 4, "leg": None, "x": None}]
