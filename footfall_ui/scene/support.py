"""What the rover stands on: support polygons and equilibrium region, the centre of mass, and by how much it stands."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import viser

from footfall.balance.balance_settings import BalanceSettings
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.maps.support_outlines import Support, bearing
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall_ui.scene.any_robot import AnyRobot, feet, held, mass_center, size
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.near import near
from footfall_ui.scene.still import stands_still


class Line(NamedTuple):
    """How an outline is drawn: color; dash and gap along it [m], no gap for a whole line; over the ground [m].

    Lengths are those of ATHLETE, here and below. The page's gauge has the same patterns in its legend.
    """

    color: tuple[int, int, int]
    dash: float
    gap: float
    over: float


LINES = {
    "plain": Line((90, 200, 255), 1.0, 0.0, 0.03),
    "conservative": Line((255, 255, 255), 0.18, 0.1, 0.035),
    "friction": Line((255, 214, 90), 0.05, 0.13, 0.045),
}
MASS = (255, 120, 120)
ALIKE = 0.01
"""Margins that differ by less are told once [m]."""
ARM = 0.1
"""Of the cross under the centre of mass [m]."""
MAST = 0.9
"""Of the margins' label over the centre of mass [m]: over the chassis, where it covers none of the outlines."""
THREAD = (150, 155, 165)
"""Of the line from the centre of mass to its label."""


@dataclass(frozen=True)
class DrawnStance:
    """support: what the wheels hold; com: the centre of mass; foot: under it at the wheels' mean height, site (3,) [m].

    margins: outline → [m], −inf where nothing is held, NaN where not known. size: of what is drawn, see :func:`.size`;
    feet: what they are called.
    """

    support: Support
    com: Array
    foot: Array
    margins: Mapping[str, float]
    size: float = 1.0
    feet: str = "wheels"

    def ring(self, outline: str) -> Array:
        """Corners on the ground, (m, 3) [m]; none where it is not known."""
        corners = self.support.corners.get(outline, np.zeros((0, 2)))
        return np.column_stack([corners, np.full(len(corners), self.foot[2] + LINES[outline].over * self.size)])

    @property
    def text(self) -> str:
        """The margins, in words; that with friction where it says something else."""
        plain, careful, friction = (self.margins[name] for name in LINES)
        if not np.isfinite(plain):
            return f"margin: too few {self.feet} stand"
        lines = [
            f"{'margin' if plain >= 0 else '✕ margin'} {plain:z.2f} m",
            f"any leg lost {careful:z.2f} m" if np.isfinite(careful) else "any leg lost: none",
        ]
        if friction == -np.inf:
            lines.append("✕ friction does not hold it")
        elif abs(friction - plain) > ALIKE:
            lines.append(f"friction {friction:z.2f} m")
        return ", ".join(lines)


def stance_of(robot: AnyRobot, state: RobotState, dem: Dem | None = None) -> DrawnStance:
    """Of the wheels that bear load; without a terrain nothing is known of friction."""
    return over(robot, state, held(robot, dem, state, bearing(robot, state)))


def over(robot: AnyRobot, state: RobotState, support: Support, balance: BalanceSettings | None = None) -> DrawnStance:
    """The centre of mass of a state, with the payload of ``balance``, over what some wheels hold."""
    com = apply(state.T_site_base, mass_center(robot, state.posture, balance))
    z = float(support.points[:, 2].mean()) if len(support.points) else float(state.T_site_base[2, 3])
    margins = {name: float(found[0]) for name, found in support.margins(com[None, :2]).items()}
    return DrawnStance(support, com, np.array([com[0], com[1], z]), margins, size(robot), feet(robot))


def dashes(ring: Array, dash: float, gap: float) -> Array:
    """A closed line through corners (m, 3), m ≥ 2, as the segments (n, 2, 3) of a pattern that goes on round corners.

    dash, gap: [m]; without a gap the sides themselves.
    """
    ends = np.roll(ring, -1, axis=0)
    if gap <= 0:
        return np.stack([ring, ends], axis=1)
    lengths = np.linalg.norm(ends - ring, axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    begins = np.arange(0.0, along[-1], dash + gap)
    cuts = np.unique(np.concatenate([begins, np.minimum(begins + dash, along[-1]), along]))
    closed = np.vstack([ring, ring[:1]])
    points = np.column_stack([np.interp(cuts, along, closed[:, i]) for i in range(3)])
    middles = 0.5 * (cuts[:-1] + cuts[1:])
    drawn = np.mod(middles, dash + gap) < dash
    return np.stack([points[:-1], points[1:]], axis=1)[drawn]


class SupportDrawing:
    """The outlines at the mean height of the contacts, each in its pattern; a plumb line from the centre of mass, and
    the margins above it. What the wheels hold is worked out again only when one of those that bear load, or the
    chassis, moves.
    """

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._drawn = Drawn(server)
        self._of: tuple[RobotState, tuple] | None = None
        self._support: tuple[Support, RobotState, tuple] | None = None

    def show(
        self,
        robot: AnyRobot,
        state: RobotState,
        dem: Dem | None = None,
        balance: BalanceSettings | None = None,
        region: bool = True,
    ) -> None:
        """dem, balance: what region and centre of mass are found with; region: whether it is drawn."""
        asked = (tuple(bearing(robot, state)), dem and dem.digest, balance and balance.digest)
        if self._of is not None and self._of[1] == (asked, region) and stands_still(self._of[0], state):
            return
        self._of = None
        stance = over(robot, state, self._feet_hold(robot, state, dem, balance, asked), balance)
        cross = np.array([[[-ARM, 0, 0], [ARM, 0, 0]], [[0, -ARM, 0], [0, ARM, 0]]]) * stance.size + stance.foot
        plumb = np.concatenate([cross, [[stance.com, stance.foot]]])
        top = stance.com + np.array([0.0, 0.0, MAST * stance.size])
        lines: dict[str, tuple[Array, tuple[int, int, int]]] = {
            "com": (plumb, MASS),
            "thread": (np.array([[stance.com, top]]), THREAD),
        }
        for name, line in LINES.items():
            ring = stance.ring(name)
            if len(ring) > 1 and (region or name != "friction"):
                lines[name] = (dashes(ring, line.dash * stance.size, line.gap * stance.size), line.color)
        scene = self._server.scene
        with self._server.atomic():
            for name, (segments, color) in lines.items():
                local, middle = near(segments)
                self._drawn.add(
                    scene.add_line_segments,
                    f"/support/{name}",
                    local,
                    color,
                    thickness=2.5,
                    thickness_units="screen",
                    position=middle,
                )
            self._drawn.add(scene.add_label, "/support/margin", stance.text, position=top)
            self._drawn.only([*(f"/support/{name}" for name in lines), "/support/margin"])
        self._of = state, (asked, region)

    def _feet_hold(
        self, robot: AnyRobot, state: RobotState, dem: Dem | None, balance: BalanceSettings | None, asked: tuple
    ) -> Support:
        """In a step only the leg in the air moves: what the others hold stays."""
        legs = asked[0]
        if self._support is not None and self._support[2] == asked and stands_still(self._support[1], state, legs):
            return self._support[0]
        found = held(robot, dem, state, legs, balance)
        self._support = found, state, asked
        return found

    def hide(self) -> None:
        self._of = None
        self._drawn.clear()
