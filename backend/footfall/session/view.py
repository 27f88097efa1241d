"""What an operator looks at on a page, and what its scene shows of it; not logged."""

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.maps.layers import LAYERS

LOOKS = ("free", "top", "leg", "wheel", "follow")
"""Where the scene is looked at from: as the operator turns it, from above, along the leg, at its wheel; following the
chassis as it moves."""
PLAYS = ("newest", "walk", "step")
"""What the ghost plays: what was made last, the walk, or the planned step or its commands."""
TAPE_ENDS = 2
Points = tuple[tuple[float, float, float], ...]


LEAST_OPACITY = 0.2
"""Colours that tell where a leg can stand are never taken away while their legend is shown."""


@dataclass(frozen=True)
class Shown:
    """What the scene shows beside rover, ground, footfall and plan; region: where the centre of mass may be with
    friction; age: how old the ground is, hatched; predicted: the second ghost while a run goes; tracks: where wheels
    were put down."""

    torques: bool = True
    forces: bool = True
    support: bool = True
    region: bool = True
    age: bool = False
    contours: bool = False
    tracks: bool = True
    suggestions: bool = True
    predicted: bool = True
    cameras: bool = False
    swept: bool = False
    tape: bool = False


SWITCHES = tuple(one.name for one in fields(Shown))


@dataclass(frozen=True)
class ViewState:
    """scrub: 0…1 along the plan; layer: a name of LAYERS, or None; look: one of LOOKS; looks: how often one was asked
    for; tape: the measured points, at most two, site frame [m]. plays: one of PLAYS, heeded until something newer than
    the events numbered up to ``plays_since`` can be played.
    opacity: of the layer's colours over what the cameras saw, LEAST_OPACITY…1: a layer that is shown stays in sight.
    goal: x, y where a walk is to lead, as the operator has set it, site frame [m]; goal_page: the page whose next click
    on the ground sets it, "" for none. follows: whether the page shows what the holder of the conn shows instead of its
    own choices."""

    leg: int = 0
    layer: str | None = "footing"
    scrub: float = 1.0
    show_ghost: bool = True
    opacity: float = 1.0
    shown: Shown = field(default_factory=Shown)
    look: str = "free"
    looks: int = 0
    tape: Points = ()
    plays: str = "newest"
    plays_since: int = -1
    goal: tuple[float, float] | None = None
    goal_page: str = ""
    follows: bool = False

    def changed(self, latest: int = -1, /, **changes: Any) -> "ViewState":
        """The view with other fields; ``shown`` as a mapping of the switches that change. Raises InvalidInput.

        latest: number of the latest event of the session.
        """
        mine = [name for name in ViewState.__dataclass_fields__ if name not in ("looks", "plays_since", "follows")]
        unknown = set(changes) - set(mine)
        if unknown:
            raise InvalidInput(f"a view has {', '.join(mine)}, not {', '.join(sorted(unknown))}")
        if changes.get("layer") is not None and changes["layer"] not in LAYERS:
            raise InvalidInput(f"there is no layer {changes['layer']!r}; there are {', '.join(LAYERS)}")
        if "scrub" in changes and not 0 <= changes["scrub"] <= 1:
            raise InvalidInput("scrub is a number from 0 to 1", scrub=changes["scrub"])
        if "opacity" in changes and not LEAST_OPACITY <= changes["opacity"] <= 1:
            raise InvalidInput(f"opacity is a number from {LEAST_OPACITY} to 1", opacity=changes["opacity"])
        if "plays" in changes:
            if changes["plays"] not in PLAYS:
                raise InvalidInput(f"plays is one of {', '.join(PLAYS)}", plays=changes["plays"])
            changes["plays_since"] = latest
        if "shown" in changes:
            changes["shown"] = replace(self.shown, **_switches(changes["shown"]))
        if "tape" in changes:
            changes["tape"] = _points(changes["tape"])
        if changes.get("goal") is not None:
            changes["goal"] = _goal(changes["goal"])
        if "look" in changes:
            if changes["look"] not in LOOKS:
                raise InvalidInput(f"look is one of {', '.join(LOOKS)}", look=changes["look"])
            changes["looks"] = self.looks + 1
        return replace(self, **changes)

    def measured(self, point: tuple[float, float, float]) -> Points:
        """The tape's points with one more; after two, the next begins anew."""
        return (*self.tape, point) if len(self.tape) < TAPE_ENDS else (point,)


def _switches(changes: Any) -> dict[str, bool]:
    if not isinstance(changes, dict) or not set(changes) <= set(SWITCHES):
        raise InvalidInput(f"shown has the switches {', '.join(SWITCHES)}", shown=str(changes))
    if not all(isinstance(one, bool) for one in changes.values()):
        raise InvalidInput("each switch of shown is true or false")
    return changes


def _goal(goal: Any) -> tuple[float, float]:
    found = np.asarray(goal, float)
    if found.shape != (2,) or not np.isfinite(found).all():
        raise InvalidInput("the goal of a walk has finite x and y [m]")
    return float(found[0]), float(found[1])


def _points(points: Any) -> Points:
    found = np.asarray(points, float)
    if len(found) > TAPE_ENDS or (len(found) and found.shape[1:] != (3,)) or not np.isfinite(found).all():
        raise InvalidInput("the tape has at most two points of three finite coordinates [m]")
    return tuple((float(x), float(y), float(z)) for x, y, z in found)
