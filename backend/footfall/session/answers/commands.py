"""What is told of conn, gate, runs and the link."""

from typing import Annotated, Literal, TypedDict

from footfall.session.answers.notes import DigestText, OneOf


class GateAnswer(TypedDict):
    """The command gate, and whether stop is latched. Nothing is armed before the rover has confirmed the `epoch`."""

    state: str
    stopped: bool
    stop_acknowledged: bool
    epoch: int
    epoch_known: bool
    run: int | None
    row: int | None
    sequence: DigestText | None
    expires_in: float | None
    mode: str | None
    waiting: bool
    why: str
    aborted: bool


class HolderAnswer(TypedDict):
    """Somebody, and the page or program that acts."""

    name: str
    role: str
    client: str
    page: str


class ConnRequestAnswer(TypedDict):
    """Somebody asks for the conn, and has it in `granted_in` [s] unless the holder answers before."""

    by: HolderAnswer
    granted_in: float


class ConnAnswer(TypedDict):
    """Who holds the conn. `number` counts its holders; `expires_in` [s] where it is not renewed."""

    number: int
    holder: HolderAnswer | None
    expires_in: float | None
    request: ConnRequestAnswer | None


class ArmedAnswer(TypedDict):
    """A token that sends this version of the sequence once, within `expires_in` [s].

    `took`: how long that was checked before [s]. So it may be sent until `took` + `expires_in` after it was asked for.
    """

    token: str
    sequence: DigestText
    took: float
    expires_in: float
    conn: ConnAnswer


class SentAnswer(TypedDict):
    """A run has begun: ids of its commands, row by row."""

    run: int
    commands: list[str]


class RowAnswer(TypedDict):
    """One row of a run. state: queued, sent (released), received (acknowledged), started, done, refused (failed),
    unknown, or unsent; times: when each of them came [s since 1970].
    """

    row: int
    id: str
    state: str
    reason: str
    times: dict[str, float]


class DifferenceAnswer(TypedDict):
    """One quantity of a run: `touch-down` of a wheel, `load` on it, `drift` or `sink` of the chassis (leg −1).

    difference: of measured and predicted; uncertainty: of the prediction, in 95 of 100 cases; null: not known. verdict:
    `differs` where the difference is larger; `advice` then says what to do.
    """

    quantity: str
    leg: int
    predicted: float | None
    measured: float | None
    difference: float | None
    uncertainty: float | None
    unit: str
    verdict: Annotated[str, OneOf(lambda: ("as_predicted", "differs", "not_told"))]
    text: str
    advice: str


class ComparedAnswer(TypedDict):
    """What came of a run, compared with its prediction. state: `waiting` until the rover is at rest after it, `none`
    where there is nothing to compare, for the `reason` given. verdict: only `as_predicted` is good; rigid: the commands
    predicted no sag.
    """

    state: Literal["none", "waiting", "compared"]
    reason: str
    verdict: Literal["as_predicted", "differs", "not_told"]
    rigid: bool | None
    differences: list[DifferenceAnswer]


class MeasuredAnswer(TypedDict):
    """As telemetry and map have it [m]. uncertainty: the true one is within it, either way, in 95 of 100 cases.

    joints, pose, ground: what that is made of, one standard deviation each; null: not known, and not in it. whole:
    whether all ground below the wheel is known; where it is not, it may be higher.
    """

    clearance: float
    uncertainty: float
    joints: float
    pose: float | None
    ground: float | None
    whole: bool


class WheelAnswer(TypedDict):
    """Clearances of a wheel in the air [m]; null: not known. commanded: were the rover as rigid as its set points.

    less: by how much less than `predicted` it is with springs softer by the tolerance of the prediction. rigid: the
    commands take the rover as rigid. low: measured less than predicted by more than the uncertainty.
    """

    leg: int
    commanded: float | None
    predicted: float | None
    less: float | None
    rigid: bool
    measured: MeasuredAnswer | None
    low: bool


class LeastClearancesAnswer(TypedDict):
    """Each wheel that swung in a run where it was measured lowest, by telemetry that came while the run went.

    every_s: telemetry nearer than this to what was looked at before is left out [s, rover clock]. looks: at so many
    frames, with the wheel in the air or not; missed: so many more that there was no time for, or that could not be
    measured. It is kept until the session is closed or the next run begins.
    """

    every_s: float
    looks: int
    missed: int
    wheels: list[WheelAnswer]


class RunAnswer(TypedDict):
    """The latest run. state: going, held, aborting or ended; mode: whole, or steps where it waits after every row."""

    number: int
    sequence: DigestText
    rows: list[RowAnswer]
    mode: str
    by: str
    state: str
    reason: str
    outcome: str
    queued: float
    ended: float | None
    compared: ComparedAnswer
    least_clearances: LeastClearancesAnswer


class LightTimeAnswer(TypedDict):
    """One-way delays, and their sum: the earliest that an answer to a command can be here."""

    telemetry_s: float
    commands_s: float
    round_trip_s: float


class OnItsWayAnswer(TypedDict):
    """A message down that can't have been answered yet: when it is there, and an answer here at the earliest [s]."""

    type: str
    id: str
    arrives_in_s: float
    answer_in_s: float


class LinkAnswer(TypedDict):
    """The link with the rover. age_s: since the latest frame came; measured_age_s: since it was measured.

    frames: that came; gaps: that are missing between them; restarts: how often counting began anew; late, repeated:
    frames that were dropped; clock_jumps: how often the rover's clock went back; acks_again: acknowledgements that told
    nothing new; faults: complaints of the rover, or about what it sent; fault: the latest.
    """

    connected: bool
    age_s: float | None
    measured_age_s: float | None
    received_at: float | None
    light_time: LightTimeAnswer
    on_the_way: list[OnItsWayAnswer]
    lost_on_the_way: int
    frames: int
    gaps: int
    restarts: int
    late: int
    repeated: int
    clock_jumps: int
    acks_again: int
    faults: int
    faults_by_kind: dict[str, int]
    fault: str


class StopAnswer(TypedDict):
    """The stop. number: of the latest, counted up for ever; heard, cleared: up to which one the rover said that it
    stands, and up to which they were cleared; untold: perhaps the rover does not know yet that it was cleared.
    """

    latched: bool
    acknowledged: bool
    reason: str
    time: float | None
    number: int
    heard: int
    cleared: int
    untold: bool


class CommandAnswer(TypedDict):
    """A command that was sent, and how far it came. time: of the latest change; times: state → when it came."""

    id: str
    sequence: DigestText
    run: int
    row: int
    state: str
    reason: str
    time: float
    times: dict[str, float] | None


class ActedBy(TypedDict):
    """Of an event's payload: who acted, and under which number of the conn."""

    by: HolderAnswer
    conn: int


class RunEnded(TypedDict):
    """Of an event's payload: how a run ended, and how many of its rows were not sent."""

    run: int
    outcome: str
    reason: str
    unsent: int
