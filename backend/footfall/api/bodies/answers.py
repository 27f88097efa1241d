"""What answers that are made by hand hold; those that are values tell it themselves. Members may be added later."""

from typing import Annotated, TypedDict

from pydantic import Field

from footfall.core.arrays import AnyArray
from footfall.core.value import Value
from footfall.session.answers.jobs import JobInSummary, Share
from footfall.session.answers.notes import DigestText

Url = Annotated[str, Field(description="path on this server")]


class Digested(TypedDict):
    """A product was made or taken in."""

    digest: DigestText


class JobAnswer(JobInSummary):
    """Long work, and where its result is once it is done."""

    url: Url
    result_url: Url | None


class PhotographJob(JobAnswer):
    """A job over photographs, and which of them it uses."""

    pairs: list[str]
    left_out: Annotated[dict[str, str], Field(description="pair → why it is not used")]


class HeightErrorAnswer(TypedDict):
    """How far the cells' surface is from the mesh that was read, vertically [m]: 95 % of it, and the most."""

    p95: float
    most: float


class TerrainAnswer(TypedDict):
    """What a terrain is, without its cells."""

    digest: DigestText
    name: str
    rows: int
    cols: int
    resolution: float
    bounds: dict[str, float]
    known: Share
    lowest: float
    highest: float
    texture: bool
    remembers: bool
    sources: list[str]
    left_out: dict[str, str]
    true_north_deg: tuple[float, float, float] | None
    height_error: HeightErrorAnswer | None
    parents: dict[str, str]


class TelemetryAnswer(TypedDict):
    """One telemetry frame, and how old it is."""

    number: int
    time: float
    mode: str
    posture: AnyArray
    T_site_base: AnyArray
    wheel_forces: AnyArray
    joint_torques: AnyArray
    age_s: float | None


class StateNamed(TypedDict):
    """The state that is planned from."""

    state: DigestText


class WhatIfAnswer(StateNamed):
    """Where the rover would stand after a shift of its chassis."""

    shift: Value | None
    posture: AnyArray
    T_site_base: AnyArray
    predicted: list[str]
    wheel_forces: AnyArray
    joint_torques: AnyArray


class Listener(TypedDict):
    """One that hears the events of a session. rate: most telemetry messages in a second; taken: messages it took.

    dropped: telemetry that gave way to newer before it was taken; waiting: messages; behind_s: how long the first of
    those waits already.
    """

    number: int
    session: str
    since: float
    rate: float
    taken: int
    dropped: int
    waiting: int
    behind_s: float
    slow: bool


class RoverLinkInfo(TypedDict):
    """Whether a rover is linked, and how many of its messages could not be used."""

    linked: bool
    bad_frames: int
    faults_by_kind: Annotated[dict[str, int], Field(description="kind → how many; docs/rover-link.md says of what")]
    last_fault: str
