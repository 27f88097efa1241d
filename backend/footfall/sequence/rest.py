"""How a rover that sags is predicted to rest after some rows of a sequence, and what they take of its joints."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from footfall.core.arrays import Array
from footfall.sequence.commands import Sequence
from footfall.sequence.foot_moves import Rows
from footfall.sequence.sequence_settings import SequenceSettings

if TYPE_CHECKING:
    from footfall.robot.model import Robot


@dataclass(frozen=True)
class PredictedRest:
    """How a rover that sags is to stand at rest after rows.

    T_site_base: (4, 4) of the chassis at rest after the rows. off: how far its origin is then from where the plan has
    it [m]; sag: how much lower it is than there [m], negative where it is higher. torque: largest share of a joint's
    limit at the ends of the rows; joint: whose that is.
    """

    T_site_base: Array
    off: float
    sag: float
    torque: float
    joint: str


def predicted_rest(robot: "Robot", sequence: Sequence, rows: Rows, T_planned: Array) -> PredictedRest | None:
    """How the rover is to stand at rest after rows.

    A joint is a spring: its torque is stiffness × (set point − angle).

    Args:
        robot: the rover.
        sequence: commands of an execution, or of a plan.
        rows: that are run.
        T_planned: pose of the chassis that the plan has then, (4, 4).

    Returns:
        The rest; None where the sequence takes the rover as rigid.
    """
    made_with = sequence.provenance.settings
    if sequence.commanded is None or sequence.at_rest is None:
        return None
    compliance = made_with.compliance if isinstance(made_with, SequenceSettings) else None
    stiffness = robot.stiffness * (1.0 if compliance is None else compliance.joint_scale)
    own = slice(rows.first, rows.first + rows.count)
    shares = np.abs(stiffness * (sequence.commanded[own] - sequence.predicted[own])) / robot.torque_limits
    _, worst = np.unravel_index(np.argmax(shares), shares.shape)
    T_site_base = sequence.poses[own][-1]
    away = T_planned[:3, 3] - T_site_base[:3, 3]
    return PredictedRest(
        T_site_base=T_site_base,
        off=float(np.linalg.norm(away)),
        sag=float(away[2]),
        torque=float(shares.max()),
        joint=robot.description.joint_names[int(worst)],
    )
