"""A gait as it is joined to one row of waypoints."""

from dataclasses import dataclass, field

from footfall.planning.gait.step import Stepped, Swung
from footfall.planning.motion import BODY
from footfall.planning.walk.body_way import At, BodyWay
from footfall.planning.walk.foot_move import Moved
from footfall.planning.walk.joined_rows import JoinedRows, swung
from footfall.planning.walk.problem import Stance


@dataclass
class GaitRows:
    """Waypoints as they are joined; at: where the rover is after the last."""

    at: At
    groups: list[tuple[int, ...]] = field(default_factory=list)
    stances: list[Stance] = field(default_factory=list)
    rows: JoinedRows = field(default_factory=JoinedRows)

    def __post_init__(self) -> None:
        self.stances.append(self.at.stance)

    def moved(self, moved: Moved) -> None:
        """Take a foot move of a walk."""
        path, phases = swung(moved)
        self.stepped(Stepped(moved.to, moved.body, Swung((moved.leg,), path, phases, moved.margins, moved.torques)))

    def stepped(self, made: Stepped) -> None:
        """Take a foot move."""
        swing, rows, number = made.swung, self.rows, len(self.groups)
        if made.body is not None:
            rows.body(made.body, number)
        elif not rows.postures:
            rows.add(self.at.posture, self.at.T_site_base, number, BODY, swing.margins[0], swing.torques[0])
        for row in range(1, len(swing.postures)):
            margin, torque = swing.margins[row], swing.torques[row]
            rows.add(swing.postures[row], made.to.T_site_base, number, swing.phases[row], margin, torque)
        self.groups.append(swing.legs)
        self.stances.append(made.to.stance)
        self.at = made.to

    def closed(self, way: BodyWay | None) -> None:
        """Take the chassis' way after the last foot move."""
        if way is not None:
            self.rows.body(way, len(self.groups))
