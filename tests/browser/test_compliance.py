"""What the page shows and does about a rover that gives way: clearances side by side, stiffness, where it goes on."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

from footfall.core.frames import apply
from footfall.planning.execution.problem import Execution, ExecutionResult
from footfall.planning.execution.rim import ground_known
from footfall.robot.kinematics import wheel_centers
from footfall.telemetry.state import RobotState, TelemetryFrame
from tests.support.page_steps import SESSION, commanded, figure, held, planned, press
from tests.support.sagging import stepped
from tests.support.server import Running
from tests.support.spoken import current
from tests.support.swinging import Swinging
from tests.support.waiting import until

Keep = Callable[[str], None]


class Rover:
    """One that stands as the session plans from, told to the server frame by frame."""

    def __init__(self, served: Running) -> None:
        live: Any = served.sessions.current
        self.live = live
        self.state: RobotState = live.get(live.state.state)
        self.set_points = self.state.posture + self.state.joint_torques / live.robot.stiffness
        self.number = 0
        live.rover.connected(lambda _: None)
        self.tell()

    def tell(self, state: RobotState | None = None, set_points: Any = None) -> bool:
        self.number += 1
        points = self.set_points if set_points is None else set_points
        self.live.rover.take_telemetry(TelemetryFrame(self.number, state or self.state, points))
        return True


def wheel(live: Any, done: Execution, at: int) -> NDArray[np.float64]:
    """Where the wheel's middle is predicted to be at a waypoint, (3,) [m]."""
    return apply(done.Ts_site_base[at], wheel_centers(live.robot, done.predicted[at]))[done.leg]


def cells(page: Page) -> list[str]:
    return page.locator("#clearances tbody td").all_inner_texts()


def test_clearance_is_shown_commanded_predicted_and_measured(console: Page, quiet: Running, look: Keep) -> None:
    assert cells(console) == ["–"] * 4
    expect(console.locator("#clearances-note")).to_have_text("No telemetry yet.")
    rover = Rover(quiet)
    live = rover.live
    planned(console, quiet, lambda: press(console, "Plan step"))
    expect(console.locator("#go-on-from")).to_have_text(
        "Going on starts from the predicted end of the plan, the rover taken as rigid."
    )
    answer = commanded(console, quiet, lambda: press(console, "Predict sag"))
    assert answer["status"] == "found", answer["reason"]
    result = live.get(answer["digest"])
    assert isinstance(result, ExecutionResult)
    done = result.execution
    assert done is not None
    live.sequences.make(answer["digest"])
    rover.tell()
    live.commands.send(live.commands.arm()["token"])
    # holes of the map are filled for the prediction, and left out where it is measured
    dem, radius = live.get(live.state.dem), live.robot.wheel_radius
    over_known = [
        at
        for at, phase in enumerate(done.phases)
        if phase == "swing" and ground_known(dem, wheel(live, done, at)[None], radius)[0]
    ]
    at = over_known[len(over_known) // 2]
    there = replace(
        rover.state, posture=done.predicted[at], T_site_base=done.Ts_site_base[at], wheel_forces=done.forces[at]
    )
    note = console.locator("#clearances-note")

    # a rover that is heard goes on telling
    def told() -> bool:
        return rover.tell(there, done.commanded[at]) and cells(console)[0] == f"{done.leg}"

    until(told, "the wheel's clearances")
    told_of = held(quiet, f"{SESSION}/clearance")["wheels"][0]
    assert cells(console) == [
        f"{done.leg}",
        f"{told_of['commanded']:.3f}",
        f"{told_of['predicted']:.3f} ({told_of['less']:.3f} less if softer)",
        # cameras do not see the ground under the standing wheels, which would tell of the pose
        f"{told_of['measured']['clearance']:.3f} ± {told_of['measured']['uncertainty']:.3f} or more",
    ]
    assert abs(told_of["measured"]["clearance"] - told_of["predicted"]) < 1e-6
    assert "lower than predicted" not in note.inner_text()
    expect(note).to_contain_text("Not in the ±, as nothing tells it: the chassis' pose.")

    # the leg hangs lower than it should: marked by a sign and words, not by a colour alone
    own = 6 * done.leg + 2
    knees = [done.predicted[at].copy() for _ in range(2)]
    for posture, turn in zip(knees, (0.12, -0.12), strict=True):
        posture[own] += turn
    hubs = [apply(there.T_site_base, wheel_centers(live.robot, posture))[done.leg, 2] for posture in knees]
    low = replace(there, posture=knees[int(np.argmin(hubs))])
    marked = console.locator("#clearances td.doubt")
    until(lambda: rover.tell(low, done.commanded[at]) and marked.count() == 1, "the mark")
    # found and looked at in one go: the table is drawn anew with the rover's next word
    sign = "() => getComputedStyle(document.querySelector('#clearances td.doubt'), '::before').content"
    assert console.evaluate(sign) == '"▲ "'
    expect(note).to_contain_text(f"Leg {done.leg} is lower than predicted, by more than the uncertainty.")
    # in sight also where commands are sent from
    console.keyboard.press("8")
    expect(console.locator("#panel-execution")).to_be_hidden()
    expect(marked).to_be_visible()
    console.locator("#clearances").evaluate("table => table.scrollIntoView({block: 'center'})")
    look("clearances")
    # nothing is told any more
    expect(note).to_contain_text("STALE")
    assert cells(console) == ["–"] * 4


def test_the_least_clearances_of_a_run_outlast_the_page(console: Page, quiet: Running, look: Keep) -> None:
    live = current(quiet)
    swinging, run = Swinging(live), live.state.runs + 1
    table = console.locator("#least-clearances")
    swinging.begin(run)
    swinging.send(run, swinging.row)
    swinging.tell(1.0, lower=0.5)
    swinging.tell(2.0)
    until(lambda: held(quiet)["run"]["least_clearances"]["looks"] == 2, "the looks")
    swinging.end(run)
    least = held(quiet)["run"]["least_clearances"]["wheels"][0]
    expect(table.locator("tbody tr")).to_have_count(1)
    shown = table.inner_text()
    assert "telemetry was looked at 2 times, at most every 0.2 s" in shown
    cells = table.locator("tbody td").all_inner_texts()
    measured = least["measured"]
    assert cells[0] == f"{swinging.leg}"
    assert cells[3].startswith(f"{figure(measured['clearance'], 3)} ± {figure(measured['uncertainty'], 3)}")
    look("least")
    console.reload()
    expect(table.locator("tbody tr")).to_have_count(1)
    assert table.inner_text() == shown


def test_the_measured_stiffness_is_taken_over_and_undone(console: Page, quiet: Running, look: Keep) -> None:
    rover = Rover(quiet)
    planned(console, quiet, lambda: press(console, "Plan step"))
    expect(console.locator("#calibration")).to_be_hidden()
    sequence = stepped(rover.live, rover.state, rover.set_points, 1.25)
    said, button = console.locator("#calibration-text"), console.locator("#take-over")
    measured = "Joint stiffness: 1.00 × is taken, 0.80 × was measured, by 1 step of mean ratio 1.25."
    expect(said).to_have_text(measured)
    console.locator("#execution-settings-box summary").click()
    field = console.locator("#sag-joint_scale")
    assert field.get_attribute("placeholder") == "1"
    assert console.locator("#sag-wheel_scale").get_attribute("placeholder") == "1"
    field.fill("0.95")
    button.scroll_into_view_if_needed()
    look("measured-stiffness")
    button.click()
    expect(said).to_have_text("Joints are taken to be 0.80 × as stiff as described, as measured.")
    expect(button).to_be_disabled()
    expect(field).to_have_value("")
    assert field.get_attribute("placeholder") == "0.8"
    assert abs(held(quiet)["joint_scale"] - 0.8) < 1e-6
    console.locator("#sag-wheel_scale").fill("0.9")
    rover.tell()
    answer = commanded(console, quiet, lambda: press(console, "Predict sag"))
    assert abs(answer["settings"]["compliance"]["joint_scale"] - 0.8) < 1e-6
    assert answer["settings"]["compliance"]["wheel_scale"] == 0.9
    console.locator("#h-plan").click()
    console.keyboard.press("Control+z")
    expect(said).to_have_text(measured)
    assert held(quiet)["joint_scale"] == 1.0
    expect(console.locator("#toast")).to_be_hidden()

    # the next step is planned from where the sagging rover ends, and the page says so
    rover.live.sequences.make(answer["digest"])
    assert held(quiet)["sequence"] != sequence.digest
    from_it = "the predicted end of the commands, the rover's sag in it."
    expect(console.locator("#go-on-from")).to_have_text(f"Going on starts from {from_it}")
    console.keyboard.press("n")
    expect(console.locator("#go-on-text")).to_contain_text(f"Planned from {from_it}")
    assert held(quiet)["after"] == held(quiet)["sequence"]
