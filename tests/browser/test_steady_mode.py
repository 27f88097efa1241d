"""What the status bar tells of the rover between two rows of a run, by the page's own module; without a browser."""

from tests.browser.test_next_thing import of_page

SCRIPT = """
    const { steadyMode } = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map((given) => steadyMode(...given))));
"""
SENDING, WAITING, IDLE = (
    {"state": "sending", "waiting": False},
    {"state": "sending", "waiting": True},
    {"state": "idle", "waiting": False},
)


def told(*asked: tuple[str, dict, float]) -> list[str]:
    return of_page(SCRIPT, "steadymode.js", [list(one) for one in asked])


def test_a_moment_between_two_rows_is_not_told_as_idle():
    # telemetry of a run of two rows: one frame each 0.2 s, idle for 0.4 s between them
    run = [("moving", SENDING, 0.0), ("idle", SENDING, 200.0), ("idle", SENDING, 400.0), ("moving", SENDING, 0.0)]
    assert told(*run) == ["moving"] * 4


def test_idle_is_told_where_it_lasts_and_where_nothing_is_to_come():
    assert told(("idle", SENDING, 2000.0), ("idle", WAITING, 200.0), ("idle", IDLE, 200.0)) == ["idle"] * 3


def test_what_stops_the_rover_is_told_at_once():
    assert told(("stopped", SENDING, 0.0), ("fault", SENDING, 0.0)) == ["stopped", "fault"]
