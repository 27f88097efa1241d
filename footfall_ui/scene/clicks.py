"""What a click in the scene chooses: the goal where its page asked for one, an end of the tape, else a footfall."""

import numpy as np
from numpy.typing import NDArray

from footfall.session.access.acting import actor
from footfall.session.live import LiveSession
from footfall.terrain.dem import Dem
from footfall.terrain.ground.surface import pick
from footfall_ui.scene.of_session import read


def choose(live: LiveSession, origin: NDArray[np.float64], direction: NDArray[np.float64]) -> None:
    """For the page that acts. A click that meets sky or unknown ground chooses nothing, and its page hears so.

    origin, direction: of the ray through the pixel, site frame (3,) [m].
    """
    if live.only_looked_at:  # its past, which nobody changes: the page says so all the while
        return
    point = None if live.state.dem is None else pick(read(live, live.state.dem, Dem), origin, direction)
    if point is None:
        live.choices.tell_missed()
        return
    x, y, z = (float(one) for one in point)
    who = actor()
    if who is not None and who.page and who.page == live.choices.view.goal_page:
        live.choices.set_view(goal=(x, y), goal_page="")
    elif live.choices.view.shown.tape:
        live.choices.set_view(tape=live.choices.view.measured((x, y, z)))
    else:
        live.maps.choose_footfall(live.choices.view.leg, x, y)
