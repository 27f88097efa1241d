"""Stiffness from how much the rover gave way compared with what was predicted."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from footfall.core.errors import InvalidInput
from footfall.planning.compliance.compliance_settings import ComplianceSettings

LEAST_DEFLECTION = 0.005
"""Joints must have been predicted to yield by so much together before they tell of stiffness [rad]."""
WIDEST = 2.0
"""The scale changes by no more than this factor at a time: a rover that sat on a rock must not undo it."""


def sag_ratio(commanded: ArrayLike, measured: ArrayLike, predicted: ArrayLike) -> float:
    """How far the joints gave way, measured over predicted, by least squares over all joints and rows.

    What counts is the change since the first row. What the prediction had learned of the joints from telemetry before
    the first row is no longer in the ratio.

    Args:
        commanded: set points, (n, legs × 6) [rad], n ≥ 2.
        measured: where the joints were at those moments of one motion, (n, legs × 6) [rad].
        predicted: where they were predicted to be, (n, legs × 6) [rad].

    Returns:
        1 where the prediction was right, 2 where half as stiff.

    Raises:
        InvalidInput: shapes don't fit, or too little was to yield for a ratio.
    """
    rows = [np.asarray(one, float) for one in (commanded, measured, predicted)]
    if rows[0].ndim != 2 or len(rows[0]) < 2 or len({one.shape for one in rows}) != 1:
        raise InvalidInput(
            "commanded, measured and predicted postures need one shape of at least two rows",
            shapes=[list(one.shape) for one in rows],
        )
    changes = [one - one[0] for one in rows]
    seen, expected = changes[1] - changes[0], changes[2] - changes[0]
    size = float(np.abs(expected).max())
    if not size >= LEAST_DEFLECTION:
        raise InvalidInput(
            f"the joints were predicted to yield by {size:z.4f} rad at most; a ratio needs {LEAST_DEFLECTION} rad",
            deflection=size,
        )
    return float(np.sum(seen * expected) / np.sum(expected * expected))


def calibrated(settings: ComplianceSettings, ratio: float) -> ComplianceSettings:
    """The settings with the joints as stiff as :func:`sag_ratio` says: twice the sag is half the stiffness.

    The ratio is kept within WIDEST of 1. Raises InvalidInput unless it is above zero.
    """
    if not 0 < ratio < np.inf:
        raise InvalidInput("joints yield under load: the ratio of sags must be above zero", ratio=ratio)
    return replace(settings, joint_scale=settings.joint_scale / float(np.clip(ratio, 1 / WIDEST, WIDEST)))
