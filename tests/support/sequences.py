"""Sequences for the tests of exports: recorded ones, and ones with any numbers, that no rule was asked about."""

import struct
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from footfall.cli.recorded import RecordedSession
from footfall.core.value import Provenance
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.predict import predict
from footfall.telemetry.command_kinds import KINDS

LEGS = 6
SAMPLES = Path(__file__).resolve().parents[2] / "sample_sessions"

HOSTILE = (
    "<script>alert(1)</script>",
    "\"'&amp;</title></style>",
    "a\r\nR00:00:00 FootFall.WAIT 9.0",
    "; \u2028\u2029\x85\x0b\x0c comment */ -->",
    "../../etc/passwd\x00",
    '=HYPERLINK("http://192.0.2.1")',
    "ロ\U0001f916\u202eevil",
    "{{7*7}}${7*7}#{7*7}`id`\\",
)

angles = st.floats(-1e3, 1e3) | st.sampled_from([-0.0, 5e-324, 1e-300, 0.1 + 0.2, 1e16, -1e22, 1e39, 16777217.0])
"""Finite numbers, among them those that an F32 or a text of few digits can't hold."""
seconds = st.floats(0, 1e6)
texts = st.sampled_from(["", "lift", "swing", "lower", "shift", *HOSTILE])


@st.composite
def any_commands(draw, least: int = 1, most: int = 12) -> tuple[Command, ...]:
    """Commands of all kinds, well formed, with any numbers."""
    return tuple(draw(st.lists(_command(), min_size=least, max_size=most)))


@st.composite
def _command(draw) -> Command:
    kind = draw(st.sampled_from(list(KINDS.values())))
    leg = draw(st.integers(0, LEGS - 1)) if kind.names_leg else None
    count = kind.joint_count(LEGS)
    joints = np.array(draw(st.lists(angles, min_size=count, max_size=count))) if count else None
    force = draw(st.floats(0.5, 1e5)) if kind.ends_by_force else None
    return Command(kind.name, leg, joints, draw(seconds), draw(texts), force)


def unchecked(commands: tuple[Command, ...], robot: str = "athlete", start: np.ndarray | None = None) -> Sequence:
    """A sequence of these commands that breaks no rule, because none was asked."""
    start = np.zeros(6 * LEGS) if start is None else start
    return Sequence(robot, commands, start, predict(start, commands), np.eye(4), (), Provenance({}))


def four_kinds(robot: str = "athlete", phase: str = "swing") -> Sequence:
    """One command of each kind."""
    rng = np.random.default_rng(5)
    return unchecked(
        (
            Command("LEG_MOVE", 2, rng.normal(size=6), 4.25, phase),
            Command("WAIT", None, None, 1 / 3, phase),
            Command("POSTURE_MOVE", None, rng.normal(size=6 * LEGS), 6.5, phase),
            Command("LEG_LOWER", 2, rng.normal(size=6), 2.0, phase, 123.45),
        ),
        robot,
    )


def recorded(name: str = "rock-step") -> Sequence:
    """The sequence of a sample session."""
    return RecordedSession(SAMPLES / name).sequence()


def bits(numbers: Iterable[float]) -> list[bytes]:
    """Numbers as their bytes: −0 is not 0."""
    return [struct.pack("<d", float(number)) for number in numbers]


def arguments(command: Command) -> dict[str, float | list[float]]:
    """What a command says, by name."""
    told: dict[str, float | list[float]] = {"duration": command.duration}
    if command.leg is not None:
        told["leg"] = command.leg
    if command.joints is not None:
        told["joints"] = command.joints.tolist()
    if command.force is not None:
        told["force"] = command.force
    return told


def require_arguments(found: dict[str, float | list[float]], command: Command) -> None:
    """The same arguments, none more and none missing, bit for bit."""
    expected = arguments(command)
    assert set(found) == set(expected)
    for name, numbers in expected.items():
        assert bits(np.atleast_1d(found[name])) == bits(np.atleast_1d(numbers)), name


def require_same_commands(found: tuple[Command, ...], expected: tuple[Command, ...]) -> None:
    """The same commands, every number bit for bit."""
    assert [(one.name, one.leg, one.phase) for one in found] == [(one.name, one.leg, one.phase) for one in expected]
    for one, other in zip(found, expected, strict=True):
        told = {"duration": one.duration, "leg": one.leg, "joints": one.joints, "force": one.force}
        require_arguments({name: part for name, part in told.items() if part is not None}, other)
