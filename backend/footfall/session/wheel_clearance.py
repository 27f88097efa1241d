"""By how much the wheels in the air of a session's rover clear the ground: commanded, predicted, and as it is measured.

What computes it loads compiled code, so it loads when first asked.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.execution.problem import Execution, ExecutionResult
from footfall.sequence.commands import Sequence
from footfall.sequence.moved_legs import moved_legs
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.session.answers.commands import MeasuredAnswer, WheelAnswer
from footfall.session.core import SessionCore
from footfall.session.gate.checks import STALE_AFTER
from footfall.session.log.fold import SessionState
from footfall.session.rover.linked import LinkedRover
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.dem import Dem
from footfall.terrain.fusion.on_map import on_map

if TYPE_CHECKING:
    from footfall.planning.execution.seen_clearance import SeenClearance


@dataclass(frozen=True)
class WheelClearance:
    """All [m]. commanded: were the rover as rigid as its set points; predicted: for the set points that the rover has,
    with ``less``, by how much less it is with springs softer by the tolerance of the prediction. None: not known.

    rigid: whether the commands took the rover as rigid: predicted is then what is commanded.
    """

    leg: int
    commanded: float | None
    predicted: float | None
    less: float | None
    rigid: bool
    seen: "SeenClearance | None"

    @property
    def low(self) -> bool:
        """Whether the wheel is lower than was predicted by more than the uncertainty of the measurement."""
        if self.predicted is None or self.seen is None:
            return False
        return self.predicted - self.seen.clearance > self.seen.uncertainty

    def is_lower_than(self, other: "WheelClearance | None") -> bool:
        """Whether it was measured to be lower, or ``other`` was not measured."""
        if self.seen is None:
            return False
        return other is None or other.seen is None or self.seen.clearance < other.seen.clearance

    def as_dict(self) -> WheelAnswer:
        """As plain JSON; ``measured`` is what was seen."""
        seen, measured = self.seen, None
        if seen is not None:
            measured = MeasuredAnswer(
                clearance=seen.clearance,
                uncertainty=seen.uncertainty,
                joints=seen.joints,
                pose=seen.pose,
                ground=seen.ground,
                whole=seen.whole,
            )
        return {
            "leg": self.leg,
            "commanded": self.commanded,
            "predicted": self.predicted,
            "less": self.less,
            "rigid": self.rigid,
            "measured": measured,
            "low": self.low,
        }


@dataclass(frozen=True)
class WheelClearances:
    """time: of the telemetry [s], None where there is none that counts, and ``reason`` then says why."""

    time: float | None
    reason: str
    wheels: tuple[WheelClearance, ...] = ()


def clearances(live: SessionCore, rover: LinkedRover) -> WheelClearances:
    """Of each wheel that bears nothing, by the latest telemetry; none where that is stale, or there is no terrain."""
    frame, age = rover.frame, rover.telemetry_age
    if frame is None or age is None:
        return WheelClearances(None, "the rover has sent no telemetry yet")
    if age > STALE_AFTER:
        return WheelClearances(None, f"the latest telemetry is {age:z.1f} s old")
    return clearances_by(live, live.state, frame)


def clearances_by(live: SessionCore, state: SessionState, frame: TelemetryFrame) -> WheelClearances:
    """The same by telemetry that came while the session was in ``state``; none where there was no terrain.

    A rover that reports no wheel forces has the leg in the air that the row on its way moves.
    """
    from footfall.maps.support_outlines import bearing

    if state.dem is None:
        return WheelClearances(None, "there is no terrain yet, so nothing is known of what is under the wheels")
    dem = live.typed(Dem, state.dem)
    stands = on_map(frame.state, dem)
    standing = bearing(live.robot, stands)
    flying = [leg for leg in live.robot.legs if leg not in standing]
    row, sequence = row_on_its_way(state), sequence_of_run(live, state)
    if not stands.wheel_forces.any() and sequence is not None and row is not None:
        moved = moved_legs(sequence)[row]
        flying = [] if moved is None else [moved]
    return WheelClearances(
        stands.time,
        "" if flying else "no wheel is in the air",
        tuple(_of_wheel(live, dem, stands, frame.commanded, leg, standing, sequence, row) for leg in flying),
    )


def _of_wheel(
    live: SessionCore,
    dem: Dem,
    state: RobotState,
    set_points: np.ndarray,
    leg: int,
    standing: list[int],
    sequence: Sequence | None,
    row: int | None,
) -> WheelClearance:
    from footfall.planning.execution.seen_clearance import along, clearance_of, foreseen, seen_clearance

    commanded, predicted, less = None, None, None
    compliance = ComplianceSettings()
    rigid = sequence is not None and sequence.at_rest is None
    if sequence is not None:
        made_with = sequence.provenance.settings
        if isinstance(made_with, SequenceSettings) and made_with.compliance is not None:
            compliance = made_with.compliance
        if rigid:
            # the chassis may be moved between the steps
            T_site_base = sequence.poses[0 if row is None else row]
            if along(np.vstack([sequence.start, sequence.predicted]), set_points) is not None:
                commanded = predicted = clearance_of(live.robot, dem, set_points, T_site_base, leg)
        else:
            done = _execution_behind(live, sequence)
            found = None if done is None or done.leg != leg else foreseen(done, set_points)
            if found is not None:
                predicted, less = found.clearance, found.less
                commanded = clearance_of(live.robot, dem, set_points, sequence.T_site_base, leg)
            elif done is None and row is not None:
                # of a walk: its chassis moves between the steps
                predicted = _on_row(live, dem, sequence, row, set_points, leg)
                commanded = clearance_of(live.robot, dem, set_points, sequence.poses[row], leg)
    seen = seen_clearance(live.robot, dem, state, leg, standing, compliance.wheel_scale)
    return WheelClearance(leg, commanded, predicted, less, rigid, seen)


def _on_row(
    live: SessionCore, dem: Dem, sequence: Sequence, row: int, set_points: np.ndarray, leg: int
) -> float | None:
    """Predicted clearance of a wheel for set points on the way of a row, along which it goes straight; else None."""
    from footfall.planning.execution.seen_clearance import along, clearance_of

    if sequence.commanded is None:
        return None
    found = along(np.vstack([sequence.set_points_before(row), sequence.commanded[row]]), set_points)
    before = (sequence.predicted[row - 1], sequence.poses[row - 1]) if row else (sequence.start, sequence.T_site_base)
    ends = [
        clearance_of(live.robot, dem, posture, T_site_base, leg)
        for posture, T_site_base in (before, (sequence.predicted[row], sequence.poses[row]))
    ]
    if found is None or ends[0] is None or ends[1] is None:
        return None
    return (1.0 - found[1]) * ends[0] + found[1] * ends[1]


def sequence_of_run(live: SessionCore, state: SessionState) -> Sequence | None:
    """What the latest run carries out, where that is stored."""
    sequence = None if state.run is None or not live.has(state.run.sequence) else live.get(state.run.sequence)
    return sequence if isinstance(sequence, Sequence) and sequence.commands else None


def row_on_its_way(state: SessionState) -> int | None:
    """The latest row of the present run that was sent; None where nothing was, or the run has ended."""
    rows = [one.row for one in state.commands if one.run == state.runs]
    return None if state.run is None or state.run.state == "ended" or not rows else rows[-1]


def _execution_behind(live: SessionCore, sequence: Sequence) -> Execution | None:
    """The execution that a sequence goes back to, through all of its edits."""
    made = live.state.products.get(live.state.before_edits(sequence.digest))
    digest = None if made is None else made.parents.get("execution")
    return None if digest is None else live.typed(ExecutionResult, digest).execution
