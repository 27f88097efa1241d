"""Which bodies are nearer where a walk begins than they are to be, from which it can hardly get away."""

import math

from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.whole_body import WholeBody
from footfall.planning.walk.body_way import At
from footfall.robot.description import link_name
from footfall.robot.model import Robot

_ON_GROUND = ("ankle_roll", "wheel")
"""Links of a standing leg that are not asked about the ground, as they don't move."""


def begins_near(robot: Robot, ground: Nearby, start: At, clearance: float) -> str:
    """Say which bodies lack most of the clearance that is asked for, how much, and what to ask for instead.

    Args:
        robot: the rover.
        ground: around it, without holes.
        start: how it stands there.
        clearance: that a walk adds to those of the robot description [m].

    Returns:
        To be put behind a refusal; "" where everything is far enough.
    """
    body = WholeBody(robot, ground, clearance)
    Ts_base_link = body.poses(start.posture[None])
    on_ground = {link_name(leg, part) for leg in robot.legs for part in _ON_GROUND}
    links = [link for link in body.links if link not in on_ground]
    nearest = min(
        body.own_gap(Ts_base_link).gap,
        body.ground_gap(start.T_site_base @ Ts_base_link, links).gap,
        key=lambda gap: gap.spare,
    )
    if nearest.spare >= 0.0:
        return ""
    left = math.floor(1000.0 * (clearance + nearest.spare)) / 1000.0
    instead = "ask for no clearance, or move a leg first" if left <= 0.0 else f"ask for {left:g} m of clearance at most"
    lacks = f"{-nearest.spare:z.3f} m of the {clearance:g} m of clearance"
    return f"; where it begins, {nearest.between} lack {lacks} that are asked for: {instead}"
