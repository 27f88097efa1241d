"""How far a rover gave way while it carried out a sequence, compared with what was predicted."""

from collections.abc import Mapping
from collections.abc import Sequence as Listed
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import Conflict
from footfall.planning.compliance.calibrate import calibrated, sag_ratio
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.sequence.commands import Sequence
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.telemetry.command_kinds import WAIT


@dataclass(frozen=True)
class Sag:
    """ratio: how far the joints gave way, measured over predicted; above 1 where they are softer.

    rows: at whose ends, the rover at rest, it was measured. assumed: what the prediction was made with; how much each
    joint gave way at rest, before it started, is in the prediction already.
    """

    sequence: str
    ratio: float
    rows: tuple[int, ...]
    assumed: ComplianceSettings

    @property
    def stiffnesses(self) -> tuple[float, float]:
        """Of joints and wheels, times the described, that the prediction was made with."""
        return self.assumed.joint_scale, self.assumed.wheel_scale


@dataclass(frozen=True)
class Calibration:
    """How stiff the joints are by what was measured, times their description.

    was: what orders take where they don't say; now: what was measured. ratio: measured over predicted sag, the mean of
    so many steps, all predicted with the stiffnesses of the latest.
    """

    was: float
    now: float
    ratio: float
    steps: int


@dataclass(frozen=True)
class MeasuredSag(Sag):
    """The sag of the latest run, and what it says of the joints with the runs before that were predicted alike.

    calibration: None where nothing could be taken over; ``refused`` then says why.
    """

    calibration: Calibration | None
    refused: str


def calibration_of(alike: Listed[Sag], was: float) -> Calibration:
    """alike: one or more, predicted with the same stiffnesses. was: the scale that orders take now.

    Raises InvalidInput where the mean ratio is not above zero, or leads beyond what springs can be.
    """
    ratio = float(np.mean([one.ratio for one in alike]))
    return Calibration(was, calibrated(alike[-1].assumed, ratio).joint_scale, ratio, len(alike))


def sag_of(sequence: Sequence, postures: Mapping[int, NDArray[np.float64]]) -> Sag:
    """postures: row → (legs × 6,) [rad], measured when it was done. What counts are pauses: the rover rests there.

    Raises Conflict where the sequence takes the rover as rigid or no pause was measured, InvalidInput where too little
    was predicted to give way for a ratio.
    """
    if sequence.at_rest is None or sequence.commanded is None:
        raise Conflict("the sequence that was sent takes the rover as rigid; one made of an execution predicts its sag")
    rows = [row for row in sorted(postures) if sequence.commands[row].kind is WAIT]
    if not rows:
        raise Conflict("no pause of the sequence is done yet; sag is measured where the rover rests")
    commanded = np.vstack([sequence.at_rest.set_points, sequence.commanded[rows]])
    predicted = np.vstack([sequence.start, sequence.predicted[rows]])
    measured = np.vstack([sequence.start, *(postures[row] for row in rows)])
    ratio = sag_ratio(commanded, measured, predicted)
    made_with = sequence.provenance.settings
    compliance = made_with.compliance if isinstance(made_with, SequenceSettings) else None
    return Sag(sequence.digest, ratio, tuple(rows), compliance or ComplianceSettings())
