"""The tether of a walk: its anchor, the line to where it leaves the chassis, and how much of it is paid out."""

import numpy as np
import viser

from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.between_rows import at
from footfall.planning.walk.problem import Tethered, WalkPlan
from footfall_ui.scene.drawn import Drawn
from footfall_ui.scene.ghost import motion_of
from footfall_ui.scene.near import near

COLOR, STAKE = (250, 240, 130), 0.25
"""Of line and anchor; length of the anchor's arms [m]."""
LINE, ANCHOR, LABEL, LENGTH = "/tether/line", "/tether/anchor", "/tether/anchor/text", "/tether/length"
ARMS = 0.5 * STAKE * np.array([[np.eye(3)[axis], -np.eye(3)[axis]] for axis in range(3)])
"""(3, 2, 3): the anchor's cross, about its middle."""


def anchor_text(tether: Tether) -> str:
    """What is said at the anchor."""
    return f"anchor, at most {tether.free_length:g} m and {tether.most_force:g} N"


def length_text(tethered: Tethered, length: float) -> str:
    """What is said where the tether leaves the chassis, with so much of it paid out [m]."""
    out = length - float(tethered.lengths[0])
    # what rounds to nothing is neither paid out nor hauled in
    since = "" if abs(out) < 0.005 else f", {abs(out):z.2f} m {'paid out' if out > 0 else 'hauled in'}"
    return f"tether {length:z.2f} m{since}"


def tether_line(plan: WalkPlan, tether: Tether, moment: float) -> Array:
    """From the anchor to where it leaves the chassis at 0…1 of a walk as the ghost plays it, site (2, 3) [m]."""
    motion = motion_of(plan)
    T = plan.Ts_site_base[0] if motion is None else at(motion, moment)[1]
    return np.array([tether.anchor, apply(T, tether.attachment)])


class TetherDrawing:
    """Drawn at one moment of a walk."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._scene, self._drawn = server.scene, Drawn(server)
        self._of: tuple[str, float] | None = None

    def show(self, plan: WalkPlan, tethered: Tethered, moment: float) -> None:
        """moment: 0…1 along the walk."""
        if self._of == (plan.digest, moment):
            return
        self._of = None
        tether, line = tethered.tether, tether_line(plan, tethered.tether, moment)
        self._lines(ANCHOR, ARMS + tether.anchor)
        self._lines(LINE, line[None])
        self._drawn.add(self._scene.add_label, LABEL, anchor_text(tether), position=np.zeros(3))
        length = float(np.linalg.norm(line[1] - line[0]))
        self._drawn.add(self._scene.add_label, LENGTH, length_text(tethered, length), position=line[1])
        self._of = plan.digest, moment

    def _lines(self, name: str, segments: Array) -> None:
        local, middle = near(segments)
        add = self._scene.add_line_segments
        self._drawn.add(add, name, local, COLOR, thickness=4.0, thickness_units="screen", position=middle)

    def hide(self) -> None:
        self._of = None
        self._drawn.clear()
