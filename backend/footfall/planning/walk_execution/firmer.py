"""How a walk is planned anew whose foot move was planned for a rigid rover and fails for one that gives way."""

from dataclasses import replace

from footfall.planning.walk.problem import WalkSettings

MORE_MARGIN, LESS_FRICTION, LESS_TORQUE = 0.05, 0.85, 0.08
"""What a walk keeps more of each time: margin of the centre of mass [m], share of the friction, share of a torque."""
MORE_CLEARANCE = 0.015
"""How much farther it keeps bodies apart each time that some would come too near [m]."""
LEAST_TORQUE_SHARE = 0.6
"""Joints are left this share of their limits at least: with less the rover hardly stands."""


def firmer(settings: WalkSettings, times: int, too_near: int = 0) -> WalkSettings:
    """Settings with which a walk stands more firmly, so many times more: 0 leaves them.

    too_near: how many times bodies would have come too near, as the rover sags.
    """
    return replace(
        settings,
        clearance=settings.clearance + too_near * MORE_CLEARANCE,
        least_margin=settings.least_margin + times * MORE_MARGIN,
        friction=settings.friction * LESS_FRICTION**times,
        most_torque=max(settings.most_torque - times * LESS_TORQUE, min(settings.most_torque, LEAST_TORQUE_SHARE)),
    )
