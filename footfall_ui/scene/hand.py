"""What is in hand, as a part of the scene: drawn from the session, and dragged for whoever drags."""

from collections.abc import Callable
from contextlib import suppress

import numpy as np
import viser
from numpy.typing import NDArray

from footfall.core.errors import FootFallError
from footfall.session.access.acting import acting
from footfall.session.live import LiveSession
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem
from footfall_ui.scene.any_robot import sole_radius
from footfall_ui.scene.drawn import server_of
from footfall_ui.scene.handles import Drag, HandleDrawing, place_of
from footfall_ui.scene.redrawing import Redrawing
from footfall_ui.visitors import Visitors


class HandPart:
    """live: the session that is drawn."""

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        live: Callable[[], LiveSession | None],
        visitors: Visitors,
    ) -> None:
        self._server, self._live, self._visitors = server_of(server), live, visitors
        # a thread of its own: the chassis that is let go waits for a worker, and the scene must not
        self._acts = Redrawing({})
        self._handles = HandleDrawing(server, self._acts.soon, self._dragged)

    def close(self) -> None:
        """Nothing is dragged any more."""
        self._acts.close()

    def draw(self, live: LiveSession) -> None:
        """The handle where the session has it."""
        held = live.hand.held
        dem = None if live.state.dem is None else live.get(live.state.dem)
        if held is None or not isinstance(dem, Dem):
            self._handles.hide()
        else:
            radius = 0.0 if held.leg is None else sole_radius(live.any_robot, held.leg)
            self._handles.show(held, dem, _chassis(live), radius)

    def stance(self, live: LiveSession) -> RobotState | None:
        """How the rover would stand with the chassis where it is dragged to; None where it is not in hand."""
        held = live.hand.held
        return None if held is None or held.place == held.origin else held.stance

    def _dragged(self, drag: Drag) -> None:
        live = self._live()
        if live is None:
            return
        with acting(self._visitors.of(self._server, drag.client)):
            # farther than a shift may be, or removed by somebody while it was dragged: the latest place stays
            with suppress(FootFallError):
                live.hand.hold(drag.what, place_of(drag.what, drag.T_site_handle, _chassis(live)), drag.index)
            if drag.over:
                # the session tells every page why it was refused
                with suppress(FootFallError):
                    live.hand.commit()


def _chassis(live: LiveSession) -> NDArray[np.float64]:
    """T_site_base as the rover stands, also in a what-if; the origin where that is not known."""
    digest = live.state.what_if or live.state.state
    found = None if digest is None else live.get(digest)
    return found.T_site_base if isinstance(found, RobotState) else np.eye(4)
