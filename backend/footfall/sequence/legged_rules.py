"""The rules of a sequence for robots that others described: form, limits, speeds, and the whole check over terrain.

Every move is a straight joint-space line, sampled as finely as ``settings.sample`` says; each sample goes through
``planning.legged.whole_check``, which the walk was planned with. Rules have the names of ``rules`` where they ask the
same; *own-joints* asks that a move has as many joints as its leg, and *upright-disc* that a disc stands on its edge.
"""

from collections.abc import Iterator

import numpy as np

from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.planning.legged.footing import FEET_OFF, rest_heights
from footfall.planning.legged.problem import LeggedSettings
from footfall.planning.legged.rolling import Stood
from footfall.planning.legged.stance import Ground
from footfall.planning.legged.whole_check import Margin
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import AtRest, Command, RuleResult
from footfall.sequence.legged_passage import LeggedPassage, carried, legged_passages
from footfall.sequence.predict import FARTHEST, needed_duration
from footfall.sequence.rules import SPEED_TOLERANCE
from footfall.sequence.sampled import samples
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.telemetry.command_kinds import KINDS, LEG_LOWER, UNKNOWN
from footfall.terrain.dem import Dem

RULES = {
    "limits": "joint-limits",
    "disc": "upright-disc",
    "support": "balance",
    "ground": "terrain-collision",
    "foot": "terrain-collision",
    "self": "self-collision",
    "effort": "torque",
}
"""Check of the whole robot → the rule that it answers."""
CLEARANCE_CHECKS: tuple[str, ...] = ("ground", "self")
BETWEEN = 0.1
"""Share of each clearance that a straight joint-space line may take between two postures that were planned."""


def check_legged_rules(
    robot: LeggedRobot,
    commands: tuple[Command, ...],
    start: Array,
    T_site_base: Array,
    dem: Dem,
    settings: SequenceSettings,
    at_rest: AtRest | None = None,
) -> tuple[tuple[RuleResult, ...], list[LeggedPassage]]:
    """Every rule on every row, and how the rows go.

    Args:
        robot: the robot.
        commands: the rows.
        start: posture before the first, (joints,) [rad or m].
        T_site_base: pose of the chassis before the first, (4, 4).
        dem: the ground, in site.
        settings: how closely is looked, and what is asked for.
        at_rest: how it stands before the first, where it sags; None: it is rigid.

    Returns:
        The results, and how each row goes.
    """
    results = [RuleResult("not-empty", -1, bool(commands), np.nan, "", f"{len(commands)} commands")]
    way = legged_passages(robot, start, T_site_base, commands, dem, at_rest)
    motion = _Motion(robot, dem, settings)
    for row, (command, passage) in enumerate(zip(commands, way, strict=True)):
        results += _row_rules(robot, row, command, passage.set_points)
        if passage.fell:
            text = "from here on nothing holds the robot on its joints' springs: it would tip over or sit down"
            results.append(RuleResult(RULES["support"], row, False, np.nan, "", text))
        elif (far := _too_far(robot, row, passage)) is not None:
            results.append(far)
        elif not np.array_equal(passage.before, passage.after):
            results += motion.rules(row, command, passage)
    if way:
        results.append(_ends(robot, dem, len(way) - 1, way[-1]))
    return tuple(results), way


def _row_rules(robot: LeggedRobot, row: int, command: Command, before: Array) -> Iterator[RuleResult]:
    def result(rule: str, holds: bool, text: str, margin: float = np.nan, unit: str = "") -> RuleResult:
        return RuleResult(rule, row, bool(holds), float(margin), unit, text)

    kind, joints = command.kind, command.joints
    known = kind is not UNKNOWN and not kind.ends_by_force
    those = ", ".join(name for name in KINDS if name != LEG_LOWER.name)
    yield result("known-command", known, command.name if known else f"{command.name!r} is none of {those}")
    if not known:
        return
    named = command.leg in robot.legs if kind.names_leg else command.leg is None
    yield result("leg-exists", named, f"leg {command.leg} of 0…{len(robot.legs) - 1}, None where it moves no leg alone")
    own = robot.layout.moved(kind, command.leg)
    count, wanted = 0 if joints is None else len(joints), own.stop - own.start
    yield result("own-joints", count == wanted, f"{count} joints of {wanted}")
    finite = bool(np.isfinite([*([] if joints is None else joints), command.duration]).all())
    yield result("finite", finite, "all numbers are finite" if finite else "a joint or the duration is not finite")
    if not finite:
        return
    yield result("duration", command.duration >= 0, f"{command.duration:z.3f} s", command.duration, "s")
    if joints is not None and count == wanted and count:
        needed = needed_duration(joints - before[own], robot.speeds[own])
        text = f"takes {command.duration:z.3f} s, the speed limits that are said need {needed:z.3f} s"
        spare = command.duration - needed
        yield result("speed", spare >= -SPEED_TOLERANCE, text, spare, "s")


def _too_far(robot: LeggedRobot, row: int, passage: LeggedPassage) -> RuleResult | None:
    """The rule of limits broken by a row that goes farther than FARTHEST: its samples would have no end."""
    ways = np.abs(passage.asked - passage.set_points)
    most = int(np.argmax(ways))
    if ways[most] <= FARTHEST:
        return None
    name, far = robot.joint_names[most], float(ways[most])
    unit, guess = ("m", "") if name in robot.layout.sliding else ("rad", ": were these degrees?")
    text = f"{name} moves by {far:z.6g} {unit}, {FARTHEST:z.1f} {unit} at most in one row{guess}"
    return RuleResult(RULES["limits"], row, False, np.nan, unit, text)


class _Motion:
    """The whole check at dense samples of a row."""

    def __init__(self, robot: LeggedRobot, dem: Dem, settings: SequenceSettings) -> None:
        asked = LeggedSettings(
            least_margin=settings.least_margin / robot.length, conservative=settings.conservative, most_effort=1.0
        )
        self.robot, self.dem, self.sample = robot, dem, settings.sample
        self.check = Ground(robot, dem, asked).check
        self.allowed: dict[str, float] = dict.fromkeys(CLEARANCE_CHECKS, BETWEEN * min(robot.clearances.values()))
        if robot.sags:
            # a foot that is let down as the chassis gives way touches a little early, and its own springs yield
            self.allowed["foot"] = FEET_OFF

    def rules(self, row: int, command: Command, passage: LeggedPassage) -> Iterator[RuleResult]:
        """A result for each check of the whole robot, where it is least, and for no-drag."""
        least: dict[str, tuple[Margin, float]] = {}
        dragged = 0.0
        postures = samples(passage.before, passage.after, self.sample)
        touched = {leg: passage.stood[leg, :2] for leg in self.robot.legs if np.isfinite(passage.stood[leg]).all()}
        stood = Stood(passage.stood, passage.feet.contacts, passage.feet.normals)
        for share, q in zip(np.linspace(0.0, 1.0, len(postures)), postures, strict=True):
            T = passage.T_before
            if command.kind.moves_all or not np.array_equal(T, passage.T_after):
                T, now = carried(self.robot, self.dem, (passage.before, T), q, stood, passage.feet.standing)
                touched |= {leg: now.soles[leg, :2] for leg in passage.feet.standing}
            dragged = max(dragged, self._dragged(q, T, passage, touched))
            for name, margin in self.check.each(q, T, passage.feet):
                if name not in least or margin.size < least[name][0].size or np.isnan(margin.size):
                    least[name] = margin, float(share)
        for name, margin in self._set_points(passage):
            if margin.size < least[name][0].size:
                least[name] = margin, 1.0
        for name, (margin, share) in least.items():
            spare = margin.size + self.allowed.get(name, 0.0)
            text = f"{name}: {margin.where}, least at {share:.0%} of the row"
            shown = spare if np.isfinite(spare) else np.nan
            yield RuleResult(RULES[name], row, spare >= 0, shown, margin.unit, text)
        away, most = beside(dragged, FEET_OFF)
        text = f"a foot moves {away} m while it is down, {most} m are allowed"
        yield RuleResult("no-drag", row, dragged <= FEET_OFF, FEET_OFF - dragged, "m", text)

    def _set_points(self, passage: LeggedPassage) -> Iterator[tuple[str, Margin]]:
        """Check and margin of what set points take that are not where the joints come to."""
        if np.array_equal(passage.asked, passage.after):
            return
        robot, asked = self.robot, passage.asked
        inside = np.minimum(asked - robot.lower, robot.upper - asked)
        at = int(np.argmin(inside))
        joint = robot.joint_names[at]
        yield "limits", Margin(float(inside[at]), f"the set point of {joint}", self.check.unit("limits", joint))
        efforts = np.abs(robot.stiffness * (asked - passage.after)) / robot.efforts
        most = robot.joint_names[int(np.argmax(efforts))]
        yield "effort", Margin(1.0 - float(efforts.max()), f"as it sags, {most}", self.check.unit("effort", most))

    def _dragged(self, q: Array, T_site_base: Array, passage: LeggedPassage, touched: dict[int, Array]) -> float:
        """How far a foot that is down is from where it came down, or rolled to [m]. touched: leg → that place, kept."""
        soles, most = apply(T_site_base, placed(self.robot, q).soles), 0.0
        for leg in self.robot.legs:
            if leg not in passage.feet.standing:
                gap = soles[leg, 2] - rest_heights(self.dem, soles[leg][None, :2], float(self.robot.radii[leg]))[0]
                if not gap <= FEET_OFF:
                    touched.pop(leg, None)
                    continue
            most = max(most, float(np.hypot(*(soles[leg, :2] - touched.setdefault(leg, soles[leg, :2])))))
        return most


def _ends(robot: LeggedRobot, dem: Dem, row: int, last: LeggedPassage) -> RuleResult:
    """Whether every foot is down at the end; over unknown ground nobody can tell, so it does not hold."""
    soles = apply(last.T_after, placed(robot, last.after).soles)
    places = zip(soles, robot.radii, strict=True)
    gaps = np.array([sole[2] - rest_heights(dem, sole[None, :2], float(radius))[0] for sole, radius in places])
    at = int(np.argmax(np.abs(gaps)))  # NaN counts as most
    off, most = beside(float(abs(gaps[at])), FEET_OFF)
    text = f"leg {robot.leg_names[at]} ends {off} m off the ground, at most {most} m still stand"
    return RuleResult("ends-on-ground", row, abs(gaps[at]) <= FEET_OFF, FEET_OFF - float(abs(gaps[at])), "m", text)
