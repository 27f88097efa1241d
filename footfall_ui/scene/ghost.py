"""The ghost: where the moving leg, or the whole rover, will be at a moment of what is planned."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.value import Value
from footfall.planning.body.follow import base_path
from footfall.planning.step.problem import PlanResult, StepPlan
from footfall.planning.walk.problem import WalkPlan, WalkResult
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall_ui.scene.robot import GHOST, RobotDrawing, leg_links

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlayedMotion:
    """What a ghost plays: waypoints (n, legs × 6) [rad], Ts_site_base (n, 4, 4). leg: the one that moves; None: all."""

    leg: int | None
    waypoints: Array
    Ts_site_base: Array


class GhostDrawing:
    """A see-through copy of one leg, or of all and the chassis, made anew where another one moves."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawing: RobotDrawing | None = None
        self._leg: int | None = None

    def show(self, robot: Robot, motion: PlayedMotion, moment: float) -> None:
        """moment: 0…1 along the motion; between waypoints the joints move in straight lines."""
        if self._drawing is None or self._leg != motion.leg:
            self.hide()
            links = None if motion.leg is None else leg_links(robot, motion.leg)
            self._drawing = RobotDrawing(self._server, robot, "ghost", links, GHOST, opacity=0.55)
            self._leg = motion.leg
        self._drawing.place(*at(motion, moment))

    def hide(self) -> None:
        if self._drawing is not None:
            self._drawing.remove()
            self._drawing = None


def motion_of(value: Value | None) -> PlayedMotion | None:
    """What a ghost plays of a plan, a walk or a sequence; None of anything else. Of a walk that was not found it is the
    part that was.
    """
    if isinstance(value, PlanResult):
        return motion_of(value.plan)
    if isinstance(value, WalkResult):
        return motion_of(value.plan or value.partial)
    if isinstance(value, WalkPlan):
        return PlayedMotion(None, value.waypoints, value.Ts_site_base)
    if isinstance(value, StepPlan):
        return PlayedMotion(value.leg, value.waypoints, np.tile(value.T_site_base, (len(value.waypoints), 1, 1)))
    if isinstance(value, Sequence) and value.commands:
        poses = np.concatenate([value.T_site_base[None], value.poses])
        waypoints = np.vstack([value.start, value.predicted])
        turned = np.abs(np.diff(waypoints, axis=0)).max(axis=0).reshape(-1, 6).max(axis=1)
        legs = np.flatnonzero(turned > 0)
        alone = value.Ts_site_base is None and len(legs) == 1
        return PlayedMotion(int(legs[0]) if alone else None, waypoints, poses)
    return None


def travelled(motion: PlayedMotion) -> Array:
    """How far the joint that goes farthest has gone at each waypoint, (n,) [rad]."""
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(motion.waypoints, axis=0)).max(axis=1))])


def at(motion: PlayedMotion, moment: float) -> tuple[Array, Array]:
    """Posture and T_site_base at 0…1 of a motion, measured by the largest joint's travel: long commands take longer.

    Between waypoints the chassis goes straight and turns about one axis.
    """
    along = travelled(motion)
    travel = np.diff(along)
    here = np.clip(moment, 0, 1) * along[-1]
    posture = np.array([np.interp(here, along, joint) for joint in motion.waypoints.T])
    after = min(max(int(np.searchsorted(along, here)), 1), len(travel))
    share = (here - along[after - 1]) / travel[after - 1] if travel[after - 1] else 1.0
    T_from, T_to = motion.Ts_site_base[after - 1 : after + 1]
    return posture, base_path(T_from, T_to, np.array([share]))[0]
