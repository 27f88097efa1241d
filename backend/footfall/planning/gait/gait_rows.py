"""A gait as it is joined to one row of waypoints."""

from dataclasses import dataclass, field

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.gait.step import Stepped, Swung
from footfall.planning.motion import BODY
from footfall.planning.walk.foot_move import At, BodyWay, Moved
from footfall.planning.walk.problem import LIFT, LOWER, SWING, Stance


@dataclass
class GaitRows:
    """Waypoints as they are joined; at: where the rover is after the last."""

    at: At
    groups: list[tuple[int, ...]] = field(default_factory=list)
    stances: list[Stance] = field(default_factory=list)
    postures: list[Array] = field(default_factory=list)
    poses: list[Array] = field(default_factory=list)
    moves: list[int] = field(default_factory=list)
    phases: list[str] = field(default_factory=list)
    margins: list[float] = field(default_factory=list)
    torques: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.stances.append(self.at.stance)

    def moved(self, moved: Moved) -> None:
        """Take a foot move of a walk."""
        over, leg = moved.swing, moved.leg
        path = np.tile(moved.body.postures[-1], (len(over.waypoints), 1))
        path[:, 6 * leg : 6 * leg + 6] = over.waypoints
        phases = tuple(LIFT if row <= over.up else SWING if row <= over.down else LOWER for row in range(len(path)))
        self.stepped(Stepped(moved.to, moved.body, Swung((leg,), path, phases, moved.margins, moved.torques)))

    def stepped(self, made: Stepped) -> None:
        """Take a foot move."""
        swung = made.swung
        if made.body is not None:
            self._body(made.body)
        elif not self.postures:
            self._add(self.at.posture, self.at.T_site_base, BODY, swung.margins[0], swung.torques[0])
        for row in range(1, len(swung.postures)):
            margin, torque = swung.margins[row], swung.torques[row]
            self._add(swung.postures[row], made.to.T_site_base, swung.phases[row], margin, torque)
        self.groups.append(swung.legs)
        self.stances.append(made.to.stance)
        self.at = made.to

    def closed(self, way: BodyWay | None) -> None:
        """Take the chassis' way after the last foot move."""
        if way is not None:
            self._body(way)

    def _body(self, way: BodyWay) -> None:
        # the first waypoint is where the rover is already
        for row in range(1 if self.postures else 0, len(way.postures)):
            self._add(way.postures[row], way.Ts_site_base[row], BODY, way.margins[row], way.torques[row])

    def _add(self, posture: Array, T: Array, phase: str, margin: float, torque: float) -> None:
        self.postures.append(posture)
        self.poses.append(T)
        self.moves.append(len(self.groups))
        self.phases.append(phase)
        self.margins.append(float(margin))
        self.torques.append(float(torque))
