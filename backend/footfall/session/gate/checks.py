"""What is checked before a sequence is armed, sent or gone on with; every refusal names its check, and by how much."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import CommandRefused
from footfall.core.frames import pose_difference
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.foot_moves import begins_a_foot_move
from footfall.telemetry.joint_layout import joint_in_words
from footfall.telemetry.state import RobotState, TelemetryFrame
from footfall.terrain.fusion.on_map import OnMap

if TYPE_CHECKING:
    from footfall.robot.model import Robot

STALE_AFTER = 2.0
"""Telemetry older than this is no ground to act on [s]."""
UNHEARD_SINCE = "the rover has sent no telemetry since it connected"
START_TOLERANCE = 0.01
"""Largest difference of any joint between the rover and the start of a sequence [rad], of one that slides as a share of
the reach by which the chassis is compared."""
POSE_TOLERANCE = 0.05
"""Largest distance of any point one reach from the chassis' origin from where the sequence has it, as a share of it."""
WEIGHT_TOLERANCE = 0.1
"""Largest difference between the weight on the wheels and the one that was planned with, as a share of that."""


@dataclass(frozen=True)
class Facts:
    """What the gate judges by.

    age: of the frame [s]; None where it is from before the present connection. dem: digest of the present terrain;
    planned_on: of the sequence's terrain. weight: of rover and payload, as the sequence was planned with [N].
    carried_out: whether every row of the sequence was done in some run. robot: whose wheels are looked at between foot
    moves; None: they are not. on_map: where the frame has the rover on the terrain; None: where the frame has it.
    reach: how far from its origin the chassis is compared [m]. sliding: joints that do.
    """

    connected: bool
    frame: TelemetryFrame | None
    age: float | None
    dem: str | None
    planned_on: str | None
    weight: float | None = None
    carried_out: bool = False
    robot: "Robot | None" = None
    on_map: OnMap | None = None
    reach: float = 1.0
    sliding: tuple[str, ...] = ()

    @property
    def place(self) -> OnMap:
        """Where the rover is. Raises CommandRefused where it was never heard."""
        if self.on_map is not None:
            return self.on_map
        if self.frame is None:
            _refuse("telemetry", "the rover has sent no telemetry yet")
        return OnMap(self.frame.state, self.frame.state)

    @property
    def fresh(self) -> bool:
        """Whether the rover was heard lately enough to act on it."""
        return self.connected and self.age is not None and self.age <= STALE_AFTER


CARRIED_OUT = "these commands were carried out; make new ones"
MOVED_ON = ("terrain", "start", "set-points", "pose")
"""Checks that commands fail because they were carried out, which is then said first."""


def require_fit(sequence: Sequence, facts: Facts, joint_names: tuple[str, ...]) -> None:
    """Raises CommandRefused, naming the check, unless ``sequence`` may be sent in the present situation."""
    try:
        _require_fit(sequence, facts, joint_names)
    except CommandRefused as err:
        if not facts.carried_out or err.details["check"] not in MOVED_ON:
            raise
        raise CommandRefused(f"{CARRIED_OUT}: {err.message}", **err.details) from None


def _require_fit(sequence: Sequence, facts: Facts, joint_names: tuple[str, ...]) -> None:
    for failure in sequence.failures[:1]:
        row = "the sequence" if failure.row < 0 else f"row {failure.row + 1}"
        _refuse("rules", f"{row} breaks {failure.rule}: {failure.text}", row=failure.row, rule=failure.rule)
    if not sequence.commands:
        _refuse("rules", "the sequence has no commands")
    frame = _require_situation(sequence, facts)
    _require_joints(facts, "start", sequence.start, frame.state.posture, joint_names, "where the sequence starts")
    if sequence.at_rest is not None:
        _require_joints(
            facts,
            "set-points",
            sequence.at_rest.set_points,
            frame.commanded,
            joint_names,
            "where the sequence was planned from",
            "the set point of ",
            "; plan the execution again",
        )
    _require_pose(sequence.T_site_base, facts)
    _require_weight(facts, frame.state)


def require_fit_to_go_on(sequence: Sequence, row: int, facts: Facts, joint_names: tuple[str, ...]) -> None:
    """Raises CommandRefused unless a run that waits before ``row`` finds the rover as the rows before it leave it.

    A leg that was lowered until it touched stands where the ground is: its joints are not asked until they are moved
    again. Between foot moves of a rover that sags all its wheels have to be where they are predicted to rest.
    """
    if row == 0:
        return require_fit(sequence, facts, joint_names)
    frame = _require_situation(sequence, facts)
    sags = sequence.at_rest is not None
    expected = sequence.set_points_before(row) if sags else sequence.predicted[row - 1]
    present = frame.commanded if sags else frame.state.posture
    due = np.array(expected)
    if due.shape == present.shape:
        for leg in _lowered(sequence.commands[:row]):
            own = slice(6 * leg, 6 * leg + 6)
            due[own] = present[own]
    whose = "the set point of " if sags else ""
    _require_joints(facts, "start", due, present, joint_names, f"where row {row + 1} starts", whose)
    _require_pose(sequence.poses[row - 1], facts)
    if sags and facts.robot is not None and begins_a_foot_move(sequence.commands, row):
        _require_rest(facts.robot, sequence, row - 1, facts.place)
    # a leg in the air changes nothing about what the others bear together
    _require_weight(facts, frame.state)
    return None


def _lowered(commands: tuple[Command, ...]) -> set[int]:
    """Legs that stand where they touched: what moved them last ended by force."""
    found: set[int] = set()
    for command in commands:
        if command.kind.moves_all:
            found.clear()
        elif command.leg is not None and command.kind.moves:
            found.discard(command.leg)
            if command.kind.ends_by_force:
                found.add(command.leg)
    return found


def _require_rest(robot: "Robot", sequence: Sequence, row: int, place: OnMap) -> None:
    """The wheels are where ``row`` was predicted to leave them, within what a walk goes on from."""
    from footfall.planning.walk_execution.off_walk import FOOT_MOVED, farthest_wheel

    found = [farthest_wheel(robot, one, sequence.predicted[row], sequence.poses[row]) for one in place.possible]
    leg, away = max(found, key=lambda one: one[1])
    if not away <= FOOT_MOVED:
        _refuse(
            "rest",
            f"the wheel of leg {leg} is {away:z.3f} m from where it was predicted to rest after row {row + 1}; "
            f"at most {FOOT_MOVED:g} m are accepted{_as_doubted(place)}",
            leg=leg,
            difference=away,
            limit=FOOT_MOVED,
        )


def _require_situation(sequence: Sequence, facts: Facts) -> TelemetryFrame:
    """The frame to judge by, of a rover that is heard, the right one, idle, on the ground that was planned on."""
    if not facts.connected:
        _refuse("link", "no rover is connected")
    if facts.frame is None:
        _refuse("telemetry", "the rover has sent no telemetry yet")
    if facts.age is None:
        _refuse("telemetry", f"{UNHEARD_SINCE}, and may stand otherwise than before: try again once it has")
    if not facts.fresh:
        _refuse(
            "telemetry",
            f"the latest telemetry is {facts.age:z.1f} s old; at most {STALE_AFTER:g} s are accepted",
            age=facts.age,
            limit=STALE_AFTER,
        )
    state = facts.frame.state
    if state.robot != sequence.robot:
        _refuse("robot", f"the sequence is for {sequence.robot}, the rover is {state.robot}")
    if state.mode != "idle":
        advice = ": clear the stop" if state.mode == "stopped" else ""
        _refuse("mode", f"the rover is {state.mode}; it must be idle{advice}", mode=state.mode)
    if facts.planned_on is None or facts.planned_on != facts.dem:
        _refuse(
            "terrain",
            "the terrain has changed since the sequence was planned; plan the step again",
            planned_on=facts.planned_on,
            present=facts.dem,
        )
    return facts.frame


def _require_joints(
    facts: Facts,
    check: str,
    expected: NDArray[np.float64],
    present: NDArray[np.float64],
    joint_names: tuple[str, ...],
    where: str,
    whose: str = "",
    advice: str = "",
) -> None:
    joint, difference = _farthest(expected, present, joint_names, _units(joint_names, facts.reach, facts.sliding))
    limit, unit = (START_TOLERANCE * facts.reach, "m") if joint in facts.sliding else (START_TOLERANCE, "rad")
    if not abs(difference) <= limit:
        of_rover = "" if whose else " of the rover"
        _refuse(
            check,
            f"{whose}{joint_in_words(joint)}{of_rover} is {difference:+z.4f} {unit} from {where}; "
            f"at most {limit:.2g} {unit} are accepted{advice}",
            joint=joint,
            difference=difference,
            limit=limit,
        )


def _require_pose(T_site_base: NDArray[np.float64], facts: Facts) -> None:
    place, limit = facts.place, POSE_TOLERANCE * facts.reach
    moved = max(pose_difference(T_site_base, one.T_site_base, facts.reach) for one in place.possible)
    if not moved <= limit:
        _refuse(
            "pose",
            f"the chassis has moved by {moved:z.3f} m since the sequence was planned; "
            f"at most {limit:.2g} m are accepted{_as_doubted(place)}",
            difference=moved,
            limit=limit,
        )


def _as_doubted(place: OnMap) -> str:
    """Why the pose is not taken as images corrected it, after what is refused over that."""
    return f", on the map and by odometry alone, as {place.doubt}" if place.doubt else ""


def _require_weight(facts: Facts, state: RobotState) -> None:
    """What the wheels bear at rest tells payload and gravity; a rover that does not measure it says zero."""
    borne = float(np.linalg.norm(state.wheel_forces.sum(axis=0)))
    if facts.weight is None or borne == 0.0:
        return
    share = borne / facts.weight - 1.0
    if not abs(share) <= WEIGHT_TOLERANCE:
        _refuse(
            "load",
            f"the wheels bear {borne:z.0f} N, {share:+.0%} against the {facts.weight:z.0f} N that were planned with; "
            f"at most {WEIGHT_TOLERANCE:.0%} are accepted; plan again with the rover's true payload and gravity",
            borne=borne,
            planned_with=facts.weight,
            limit=WEIGHT_TOLERANCE,
        )


def worst_joint(
    start: NDArray[np.float64],
    state: RobotState,
    joint_names: tuple[str, ...],
    reach: float = 1.0,
    sliding: tuple[str, ...] = (),
) -> tuple[str, float]:
    """The joint that is farthest from ``start`` (joints,), and by how much (measured − start) [rad or m].

    A joint that slides counts as farther by as much as the reach, by which the chassis is compared, is less than 1 m.
    """
    return _farthest(start, state.posture, joint_names, _units(joint_names, reach, sliding))


def _units(joint_names: tuple[str, ...], reach: float, sliding: tuple[str, ...]) -> NDArray[np.float64]:
    """In what each joint's difference is counted: 1 rad, or the reach [m] where it slides."""
    return np.array([reach if name in sliding else 1.0 for name in joint_names])


def _farthest(
    expected: NDArray[np.float64], present: NDArray[np.float64], joint_names: tuple[str, ...], per: NDArray[np.float64]
) -> tuple[str, float]:
    """The joint that is farthest away, each counted in its own unit ``per``, and by how much."""
    if expected.shape != present.shape:
        return "the number of joints", float("inf")
    difference = present - expected
    i = int(np.argmax(np.abs(difference) / per))
    return joint_names[i], float(difference[i])


def _refuse(check: str, message: str, **details: Any) -> NoReturn:
    raise CommandRefused(message, check=check, **details)
