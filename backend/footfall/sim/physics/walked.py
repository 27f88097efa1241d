"""Physics as the referee of a foot move: what came of its execution, carried out by the rover in physics."""

from dataclasses import dataclass

import numpy as np

from footfall.core.frames import apply
from footfall.planning.walk_execution.problem import FootMoveExecution
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.of_execution import sequence_of_execution
from footfall.sim.physics.referee import referee
from footfall.sim.physics.rover import PhysicalRover
from footfall.sim.physics.verdict import RefereeReport, RefereeSettings


@dataclass(frozen=True, eq=False)
class FootMoveReport:
    """number: of the foot move; leg: which it moves, None where only the chassis goes.

    report: what the referee saw. lost: how often a supporting wheel left the ground. stayed: how often the moved wheel
    was not lifted or put down as planned. touch: how far its middle is from where it was planned to stand when it
    touches down, seen from above [m]; NaN where none was moved, or did not touch. rest: how far the chassis' origin
    rests from where it was predicted to [m]. load: least force on a supporting wheel [N].
    """

    number: int
    leg: int | None
    report: RefereeReport
    lost: int
    stayed: int
    touch: float
    rest: float
    load: float

    @property
    def tipped(self) -> bool:
        """Whether the rover fell."""
        return bool(self.report.tipped)

    @property
    def contacts(self) -> int:
        """Contacts that nobody planned, and supporting wheels that left the ground."""
        return len(self.report.contacts) + self.lost


def carry_out(rover: PhysicalRover, move: FootMoveExecution) -> FootMoveReport:
    """Carry a foot move out, from how the rover stands now; it is moved. Raises InvalidInput where it does not fit."""
    robot = rover.robot
    commands, step = sequence_of_execution(move, robot), move.step
    report = referee(
        robot,
        commands,
        rover.dem,
        RefereeSettings(rover.settings),
        goals={} if step is None else {step.leg: step.plan.contact},
        poses=commands.Ts_site_base,
        rover=rover,
    )
    lost = [event for event in report.events if event.kind == "lift-off" and not event.planned]
    own = [event for event in report.events if step is not None and event.leg == step.leg]
    landed = [event for event in own if event.kind == "touch-down"]
    touch = np.nan
    if step is not None and landed:
        goal = apply(step.plan.T_site_base, wheel_centers(robot, step.plan.waypoints[-1])[step.leg])
        touch = float(np.linalg.norm((landed[-1].center - goal)[:2]))
    expected = move.parts[-1].Ts_site_base[-1, :3, 3]
    return FootMoveReport(
        number=move.number,
        leg=None if step is None else step.leg,
        report=report,
        lost=len(lost),
        stayed=0 if step is None else abs(len(landed) - 1) + abs(len(own) - len(landed) - 1),
        touch=touch,
        rest=float(np.linalg.norm(rover.T_site_base[:3, 3] - expected)),
        load=float(report.least_load.min()),
    )


def longest_slip(reports: list[FootMoveReport]) -> float:
    """The most that a wheel slipped while it stood [m], over all foot moves from when it came down until it is lifted.

    What it slips in each is added up, whichever way it goes: at least as much as it is off in the end.
    """
    longest, standing = 0.0, None
    for one in reports:
        slip = one.report.slip
        standing = slip.copy() if standing is None else standing + slip
        longest = max(longest, float(standing.max()))
        if one.leg is not None:
            standing[one.leg] = 0.0
    return longest
