"""What the referee saw of a sequence carried out in physics, and by which limits it is judged."""

from collections.abc import Sequence as Listed

import numpy as np
from numpy.typing import NDArray

from footfall.core.bounds import require_above_zero, require_not_negative
from footfall.core.value import Value, value
from footfall.sim.physics.physics_settings import PhysicsSettings


@value
class RefereeSettings(Value):
    """What is simulated, and what is still good.

    slip: of a supporting wheel's material over the ground [m]. touch: from the goal to where the wheel came down, seen
    from above [m]. chassis: from where it is expected (or stood at first) [m], as a bound over the points within 1 m
    of its origin. clearance: least height of the swinging leg over the ground [m]. torque: largest share of a joint's
    torque limit. rest: seconds that the rover is watched after the last command.
    """

    physics: PhysicsSettings = PhysicsSettings()
    slip: float = 0.01
    touch: float = 0.05
    chassis: float = 0.05
    clearance: float = 0.0
    torque: float = 1.0
    rest: float = 1.0

    def check(self) -> None:
        require_above_zero(slip=self.slip, touch=self.touch, chassis=self.chassis, torque=self.torque)
        require_not_negative(clearance=self.clearance, rest=self.rest)


@value
class WheelEvent(Value):
    """A wheel left the ground or came down on it. kind: "lift-off" or "touch-down". row: the command under way.

    time: since the start [s]. point: (3,) where it left, or met, the ground, site [m]; center: (3,) of its rim then.
    planned: whether it is the leg that the row moves. off: of a touch-down, distance to the leg's goal seen from above
    [m]; NaN where none is known.
    """

    kind: str
    leg: int
    row: int
    time: float
    point: NDArray[np.float64]
    center: NDArray[np.float64]
    planned: bool
    off: float


@value(stored_as="Contact")
class UnplannedContact(Value):
    """A contact that nobody planned, from its first moment to its last. force: the largest [N]. row: when it began.

    link_a, link_b: as the collision checks name them. start, end: since the start of the run [s].
    """

    link_a: str
    link_b: str
    row: int
    start: float
    end: float
    force: float


@value
class RefereeReport(Value):
    """What came of a sequence in physics. Arrays over rows have one entry for each command carried out.

    sequence: its digest; settings: what was simulated. failures: what did not hold, in words; none when it passed.
    commands: how many rows were done. ended: seconds after the start of each row. postures, Ts_site_base: where the
    joints (rows, legs × 6) [rad] and the chassis (rows, 4, 4) were then.
    settled: how far the chassis was from T_site_base when the rover stood at rest before the first row (3,) [m].
    events, contacts: wheels that lifted and touched; contacts that nobody planned.
    touch: (legs,) distance from the goal to where the wheel stands in the end, seen from above [m]; NaN where the leg
    has no goal or does not stand. clearance: least height of the swinging leg's corners over the ground below them
    [m]; NaN where no row is a swing. slip: (legs,) how far a supporting wheel's material moved over the ground while
    it stood, at its contact, from when its leg was no longer moved [m]. drag: (legs,) the same of the leg that is
    moved. chassis: (rows,) largest distance of
    the chassis from where it is expected within the row [m]. sag: (rows,) how much lower it is than expected at the
    row's end [m]. torque: (legs × 6,) largest share of each joint's limit. tipped: why the rover fell, or "".
    least_load: (legs,) least force of the ground on each wheel while it supports [N]; infinite for one that never does.
    """

    sequence: str
    settings: RefereeSettings
    failures: tuple[str, ...]
    commands: int
    ended: NDArray[np.float64]
    postures: NDArray[np.float64]
    Ts_site_base: NDArray[np.float64]
    settled: NDArray[np.float64]
    events: tuple[WheelEvent, ...]
    contacts: tuple[UnplannedContact, ...]
    touch: NDArray[np.float64]
    clearance: float
    slip: NDArray[np.float64]
    drag: NDArray[np.float64]
    chassis: NDArray[np.float64]
    sag: NDArray[np.float64]
    torque: NDArray[np.float64]
    tipped: str
    least_load: NDArray[np.float64]

    @property
    def passed(self) -> bool:
        """Whether everything held."""
        return not self.failures


def failures(report: RefereeReport, moved: Listed[int], refused: str) -> tuple[str, ...]:
    """What of a report does not hold, in words. moved: legs that the sequence lifts; refused: why a row was, or ""."""
    limits = report.settings
    said = [text for text in (report.tipped, "" if report.tipped else refused) if text]
    for contact in report.contacts:
        said.append(
            f"row {contact.row + 1}: {contact.link_a} touched {contact.link_b} with {contact.force:z.0f} N "
            f"from {contact.start:z.1f} s to {contact.end:z.1f} s"
        )
    for event in report.events:
        if event.kind == "lift-off" and not event.planned:
            said.append(f"row {event.row + 1}: the supporting wheel {event.leg} left the ground at {event.time:z.1f} s")
    for leg in moved:
        own = [event.kind for event in report.events if event.leg == leg and event.planned]
        if "lift-off" not in own:
            said.append(f"wheel {leg} never left the ground")
        elif own[-1] != "touch-down":
            said.append(f"wheel {leg} did not come down again")
    said += _beyond(report.touch, limits.touch, "wheel {} stands {:z.0f} mm from its goal")
    said += _beyond(report.slip, limits.slip, "the supporting wheel {} slipped {:z.1f} mm")
    if len(report.chassis) and report.chassis.max() > limits.chassis:
        row = int(np.argmax(report.chassis))
        said.append(f"row {row + 1}: the chassis was {1000 * report.chassis[row]:z.0f} mm from where it should be")
    if report.clearance < limits.clearance:
        said.append(f"the swinging leg came within {1000 * report.clearance:z.0f} mm of the ground")
    joint = int(np.argmax(report.torque))
    if report.torque[joint] > limits.torque:
        share = report.torque[joint]
        said.append(f"joint {joint % 6} of leg {joint // 6} took {share:.0%} of its torque limit")
    return tuple(said)


def _beyond(sizes: NDArray[np.float64], limit: float, text: str) -> list[str]:
    return [text.format(leg, 1000 * size) for leg, size in enumerate(sizes) if size > limit]
