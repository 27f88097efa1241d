"""The messages of the rover link as values, and their one JSON form. ``docs/rover-link.md`` tells the protocol.

:func:`encode` and :func:`decode` are inverse; decoding is strict. Images travel as binary frames
(:mod:`footfall.io.link_images`) whose header has the forms of :mod:`footfall.telemetry.link_state`.
"""

import json
from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput, InvalidTelemetry
from footfall.core.value import LATER, SOFTWARE_VERSION, Value, value
from footfall.telemetry.command_kinds import CommandKind, kind_named
from footfall.telemetry.fields import Fields, parse_object
from footfall.telemetry.joint_layout import JointLayout
from footfall.telemetry.link_state import layout_from, layout_object, read_state, state_object
from footfall.telemetry.state import TelemetryFrame

PROTOCOL = 2
SUBPROTOCOL = "footfall-rover-2"
PATH = "/api/v1/rover"
TOKEN_VARIABLE = "FOOTFALL_ROVER_TOKEN"
"""Environment variable with the token that a rover shows to a server with accounts."""
ACK_STATES = ("received", "started", "done", "refused", "outdated", "unknown")
EPOCHS_AHEAD = 100 * 31_557_600
"""An epoch is the seconds since 1970 and what was counted on from there: no ground's clock is a century wrong."""
MAX_TEXT_FRAME = 1 << 20
"""Longest text frame [bytes]."""
MAX_BINARY_FRAME = 16 << 20
"""Longest binary frame [bytes]: nine pairs of 640 × 480 grey images need at most 6 MB."""


@value
class HelloMessage(Value):
    """First message of the rover: who it is. legs: how many it has.

    id: another one for each connection. epoch: the newest that it has heard, None since it was started.
    described: legs and joints, by name, of a robot that others described; None: of ATHLETE's build.
    """

    robot: str
    legs: int
    protocol: int = PROTOCOL
    software: str = SOFTWARE_VERSION
    id: str = "hello"
    epoch: int | None = None
    described: JointLayout | None = field(default=None, metadata=LATER)


@value
class EpochMessage(Value):
    """The epoch, down as an answer to the ``hello`` called ``id``; up: the newest that the rover has heard."""

    id: str
    epoch: int


@value
class CommandMessage(Value):
    """One command down. id: unique; a rover executes an id at most once. sequence: digest; row: in that sequence.

    name, leg, joints [rad], duration [s], force [N]: as in :class:`footfall.sequence.commands.Command`.
    epoch: in which it was released; a rover that has heard of a newer one does not carry it out.
    """

    id: str
    sequence: str
    row: int
    name: str
    leg: int | None
    joints: NDArray[np.float64] | None
    duration: float
    force: float | None = None
    epoch: int = 0

    @property
    def kind(self) -> CommandKind:
        """What kind it is by its name; UNKNOWN where there is none of that name."""
        return kind_named(self.name)


@value
class AckMessage(Value):
    """What became of a command. state: one of ACK_STATES; reason: text for the last three of them, else "".

    "outdated": it came too late to be carried out. "unknown" answers a query only: the rover remembers no command of
    that id. time: rover clock [s].
    """

    id: str
    state: str
    reason: str
    time: float

    def check(self) -> None:
        """Raises InvalidTelemetry for a state that is none of ACK_STATES."""
        if self.state not in ACK_STATES:
            raise InvalidTelemetry(f"an acknowledgement is one of {', '.join(ACK_STATES)}", state=self.state)


@value
class QueryMessage(Value):
    """What became of command ``id``? Answered with its last acknowledgement; nothing moves."""

    id: str


@value
class StopMessage(Value):
    """Stop at once and stay stopped. epoch: which the stop began."""

    id: str
    epoch: int = 0


@value
class StopAckMessage(Value):
    """The rover stands still because of stop ``id``. time: rover clock [s]."""

    id: str
    time: float


@value
class ClearStopMessage(Value):
    """Accept commands again. epoch: a rover that has heard of a newer one stays stopped."""

    id: str
    epoch: int = 0


@value
class ImageRequestMessage(Value):
    """Take images. pairs: names of camera pairs, or None for all."""

    id: str
    pairs: tuple[str, ...] | None


@value
class ErrorMessage(Value):
    """The sender could not use a message. id: of that message, or "" where it had none that could be read."""

    id: str
    text: str


Message = (
    HelloMessage
    | EpochMessage
    | TelemetryFrame
    | CommandMessage
    | AckMessage
    | QueryMessage
    | StopMessage
    | StopAckMessage
    | ClearStopMessage
    | ImageRequestMessage
    | ErrorMessage
)

_names: dict[type, str] = {
    HelloMessage: "hello",
    EpochMessage: "epoch",
    TelemetryFrame: "telemetry",
    CommandMessage: "command",
    AckMessage: "ack",
    QueryMessage: "query",
    StopMessage: "stop",
    StopAckMessage: "stop_ack",
    ClearStopMessage: "clear_stop",
    ImageRequestMessage: "image_request",
    ErrorMessage: "error",
}


def encode(message: Message) -> str:
    """One text frame. Numbers are written so that they read back to the same bits."""
    return json.dumps(message_object(message), allow_nan=False)


def decode(text: str | bytes, legs: int | None = None, described: JointLayout | None = None) -> Message:
    """A message from one text frame; see :func:`message_from`.

    Raises InvalidTelemetry saying what is wrong; its ``details["fault"]`` names the kind, one of
    ``footfall.telemetry.fields.FAULTS``; "wrong-field" where none is said.
    """
    if len(text) > MAX_TEXT_FRAME:
        raise InvalidTelemetry(f"a text frame has at most {MAX_TEXT_FRAME} bytes", bytes=len(text), fault="too-large")
    return message_from(parse_object(text), legs, described)


def kind_of(message: Message) -> str:
    """The ``type`` of a message."""
    return _names[type(message)]


def message_object(message: Message) -> dict[str, object]:
    """JSON-ready form of a message; ``type`` names it."""
    body: dict[str, object] = {"type": _names[type(message)]}
    match message:
        case TelemetryFrame():
            body |= {"number": message.number, **state_object(message.state), "commanded": message.commanded.tolist()}
        case HelloMessage():
            body |= {
                "protocol": message.protocol,
                "robot": message.robot,
                "legs": message.legs,
                "software": message.software,
                "id": message.id,
                "epoch": message.epoch,
            }
            if message.described is not None:
                body |= {"joints": layout_object(message.described)}
        case CommandMessage():
            body |= {
                "id": message.id,
                "sequence": message.sequence,
                "row": message.row,
                "name": message.name,
                "leg": message.leg,
                "joints": None if message.joints is None else message.joints.tolist(),
                "duration": message.duration,
                "force": message.force,
                "epoch": message.epoch,
            }
        case AckMessage():
            body |= {"id": message.id, "state": message.state, "reason": message.reason, "time": message.time}
        case StopAckMessage():
            body |= {"id": message.id, "time": message.time}
        case EpochMessage() | StopMessage() | ClearStopMessage():
            body |= {"id": message.id, "epoch": message.epoch}
        case QueryMessage():
            body |= {"id": message.id}
        case ImageRequestMessage():
            body |= {"id": message.id, "pairs": None if message.pairs is None else list(message.pairs)}
        case ErrorMessage():
            body |= {"id": message.id, "text": message.text}
    return body


def message_from(body: Mapping[str, object], legs: int | None = None, described: JointLayout | None = None) -> Message:
    """Inverse of :func:`message_object`. legs: how many the rover has, where that is known.

    described: its legs and joints, where it is not of ATHLETE's build: posture, torques and set points are then in the
    order of these. Raises InvalidTelemetry for an unknown type, another protocol version, another number of legs,
    a missing, unknown or wrongly typed field, and numbers that are not finite.
    """
    fields = Fields(body, "message")
    try:
        kind = fields.choice("type", tuple(_names.values()))
    except InvalidTelemetry as err:
        err.details["fault"] = "unknown-message"
        raise
    fields = Fields({name: one for name, one in body.items() if name != "type"}, kind)
    try:
        message = _read(kind, fields, legs, described)
    except InvalidTelemetry:
        raise
    except InvalidInput as err:
        raise InvalidTelemetry(f"{kind}: {err.message}", **err.details) from err
    fields.end()
    return message


def _read(kind: str, fields: Fields, legs: int | None, described: JointLayout | None) -> Message:
    match kind:
        case "hello":
            return _hello(fields, legs)
        case "epoch":
            return EpochMessage(fields.identifier(), fields.whole("epoch"))
        case "telemetry":
            number = fields.whole("number")
            state = read_state(fields, legs, described)
            return TelemetryFrame(number, state, fields.array("commanded", state.posture.shape))
        case "command":
            name = fields.text("name", longest=64)
            leg = fields.whole_or_null("leg")
            return CommandMessage(
                id=fields.identifier(),
                sequence=fields.text("sequence", longest=64),
                row=fields.whole("row"),
                name=name,
                leg=leg,
                joints=_joints(fields, kind_named(name), leg, legs, described),
                duration=fields.number("duration"),
                force=fields.number_or_null("force"),
                epoch=fields.whole("epoch"),
            )
        case "ack":
            return AckMessage(
                id=fields.identifier(),
                state=fields.choice("state", ACK_STATES),
                reason=fields.text("reason", empty=True),
                time=fields.number("time"),
            )
        case "query":
            return QueryMessage(fields.identifier())
        case "stop":
            return StopMessage(fields.identifier(), fields.whole("epoch"))
        case "stop_ack":
            return StopAckMessage(fields.identifier(), fields.number("time"))
        case "clear_stop":
            return ClearStopMessage(fields.identifier(), fields.whole("epoch"))
        case "image_request":
            return ImageRequestMessage(fields.identifier(), fields.texts_or_null("pairs"))
        case _:
            return ErrorMessage(fields.text("id", longest=64, empty=True), fields.text("text", empty=True))


def _joints(
    fields: Fields, kind: CommandKind, leg: int | None, legs: int | None, described: JointLayout | None
) -> NDArray[np.float64] | None:
    if described is None:
        return fields.angles_or_null("joints", legs) if kind.moves_all else fields.array_or_null("joints", (6,))
    own = described.moved(kind, leg)
    return fields.array_or_null("joints", (own.stop - own.start,))


def _hello(fields: Fields, legs: int | None) -> HelloMessage:
    protocol = fields.whole("protocol")
    if protocol != PROTOCOL:
        raise InvalidTelemetry(
            f"hello: the rover speaks protocol {protocol}, this end speaks {PROTOCOL}",
            protocol=protocol,
            expected=PROTOCOL,
            fault="wrong-version",
        )
    hello = HelloMessage(
        protocol=protocol,
        robot=fields.text("robot", longest=64),
        legs=fields.whole("legs", least=1),
        software=fields.text("software", longest=64),
        id=fields.identifier(),
        epoch=fields.whole_or_null("epoch"),
        described=layout_from(fields.inner("joints")) if fields.has("joints") else None,
    )
    if hello.described is not None and len(hello.described.legs) != hello.legs:
        raise InvalidTelemetry(
            f"hello: legs is {hello.legs}, and joints names {len(hello.described.legs)}", fault="wrong-legs"
        )
    if legs is not None and hello.legs != legs:
        raise InvalidTelemetry(
            f"hello: the rover has {hello.legs} legs, {legs} are expected", legs=hello.legs, fault="wrong-legs"
        )
    return hello
