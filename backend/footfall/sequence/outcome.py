"""What came of a run, compared with its prediction: touch-down, wheel loads, drift and sink of the chassis.

A difference beyond the prediction's own uncertainty says so; what was not predicted, or not measured, is never good.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.core.value import Provenance, Value, value
from footfall.telemetry.state import RobotState

Verdict = Literal["as_predicted", "differs", "not_told"]

VERDICTS = ("as_predicted", "differs", "not_told")
CHASSIS = -1
"""In place of a leg."""

ADVICE = {
    "touch-down": "look at how the wheel stands before the next step: take images and build the terrain anew",
    "load": "the ground is not as high as the map says, or the springs are others: build the terrain anew, and look at "
    "the measured sag, before a leg beside it is lifted",
    "drift": "look at the measured sag and take it over, and check the payload, before the next step",
    "sink": "look at the measured sag and take it over, and check the payload, before the next step",
}
"""What to do where a quantity differs, by its name."""
HOLD = "make the next commands with the pose held: these took the rover as rigid, and it sags"


@value
class Difference(Value):
    """One quantity, predicted and measured.

    quantity: "touch-down" [m], how far a wheel that was moved stands from where it was predicted, seen from above;
    "load" [N], on a wheel along the ground's normal; "drift" [m], way of the chassis seen from above; "sink" [m], how
    much lower it is than at the start. leg: CHASSIS for the last two. difference: of where it is and where it was
    predicted [unit]; uncertainty: of the prediction, in 95 of 100 cases. NaN: not known.
    """

    quantity: str
    leg: int
    predicted: float
    measured: float
    difference: float
    uncertainty: float
    unit: str
    verdict: str
    text: str
    advice: str

    def check(self) -> None:
        """Raises InvalidInput for a verdict that is none of VERDICTS."""
        if self.verdict not in VERDICTS:
            raise InvalidInput(f"a verdict is one of {', '.join(VERDICTS)}", verdict=self.verdict)


@value
class Outcome(Value):
    """What came of a run of so many rows. sags: whether telemetry shows that the rover does; None: it tells nothing.

    rigid: the commands took it as rigid.
    """

    run: int
    rows: int
    rigid: bool
    sags: bool | None
    differences: tuple[Difference, ...]
    provenance: Provenance

    @property
    def verdict(self) -> Verdict:
        """Of all. Commands that take a rover as rigid predict nothing of one that sags, or may."""
        verdicts = {one.verdict for one in self.differences}
        if "differs" in verdicts:
            return "differs"
        if "as_predicted" not in verdicts or (self.rigid and self.sags is not False):
            return "not_told"
        return "as_predicted" if self.rigid or "not_told" not in verdicts else "not_told"


@dataclass(frozen=True)
class Foretold:
    """Where the rover is predicted to be after some rows, each with by how much that may be wrong in 95 of 100 cases.

    start, end: T_site_base (4, 4). stepped: legs whose wheels were put elsewhere; hubs: (legs, 3), site [m]. loads:
    (legs,) [N]; NaN where they are not predicted. …_uncertainty: [m], [N]; touch: (legs,).
    """

    rigid: bool
    start: Array
    end: Array
    stepped: tuple[int, ...]
    hubs: Array
    normals: Array
    loads: Array
    touch_uncertainty: Array
    load_uncertainty: Array
    drift_uncertainty: float
    sink_uncertainty: float


@dataclass(frozen=True)
class Seen:
    """Where it is measured to be. forces: of the ground on the wheels, site, (legs, 3) [N]; None: it reports none."""

    T_site_base: Array
    hubs: Array
    forces: Array | None


def seen_at_rest(state: RobotState, feet: Array) -> Seen:
    """Where a rover is by its telemetry.

    Args:
        state: at rest, its pose on the map.
        feet: middles of its wheels or soles, (legs, 3) in base [m].

    Returns:
        What it is compared by; it has no forces where it reports none.
    """
    forces = np.array(state.wheel_forces)
    T_site_base = np.array(state.T_site_base)
    return Seen(T_site_base, apply(T_site_base, feet), forces if forces.any() else None)


def compare(
    foretold: Foretold, seen: Seen, advice: Mapping[str, str] | None = None, names: Sequence[str] = ()
) -> tuple[Difference, ...]:
    """Each quantity with a verdict.

    Args:
        foretold: where the rover is predicted to be.
        seen: where it is.
        advice: what to do where a quantity differs, by its name; None: what a rover of ATHLETE's build asks for.
        names: of the legs; none: their numbers.

    Returns:
        Touch-down of each foot that was moved, then every foot's load, then the chassis.
    """
    advice = advice or (dict.fromkeys(ADVICE, HOLD) if foretold.rigid else ADVICE)
    names = names or [str(leg) for leg in range(len(foretold.hubs))]
    off = np.linalg.norm((seen.hubs - foretold.hubs)[:, :2], axis=1)
    found = [
        _difference("touch-down", leg, 0.0, away, away, float(foretold.touch_uncertainty[leg]), advice, names[leg])
        for leg, away in ((leg, float(off[leg])) for leg in foretold.stepped)
    ]
    for leg in range(len(foretold.hubs)):
        measured = float("nan") if seen.forces is None else float(seen.forces[leg] @ foretold.normals[leg])
        predicted = float(foretold.loads[leg])
        unsure = float(foretold.load_uncertainty[leg])
        found.append(_difference("load", leg, predicted, measured, measured - predicted, unsure, advice, names[leg]))
    start, end, now = (T[:3, 3] for T in (foretold.start, foretold.end, seen.T_site_base))
    way, went, apart = (float(np.linalg.norm(move[:2])) for move in (end - start, now - start, now - end))
    found.append(_difference("drift", CHASSIS, way, went, apart, foretold.drift_uncertainty, advice))
    sinks, sank = float(start[2] - end[2]), float(start[2] - now[2])
    found.append(_difference("sink", CHASSIS, sinks, sank, sank - sinks, foretold.sink_uncertainty, advice))
    return tuple(found)


def _difference(
    quantity: str,
    leg: int,
    predicted: float,
    measured: float,
    difference: float,
    uncertainty: float,
    advice: Mapping[str, str],
    name: str = "",
) -> Difference:
    unit = "N" if quantity == "load" else "m"
    verdict: Verdict = "not_told"
    if np.isfinite(difference) and np.isfinite(uncertainty):
        verdict = "differs" if abs(difference) > uncertainty else "as_predicted"
    return Difference(
        quantity=quantity,
        leg=leg,
        predicted=predicted,
        measured=measured,
        difference=difference,
        uncertainty=uncertainty,
        unit=unit,
        verdict=verdict,
        text=_in_words(quantity, name, predicted, measured, difference, uncertainty),
        advice=advice[quantity] if verdict == "differs" else "",
    )


def _in_words(quantity: str, leg: str, predicted: float, measured: float, difference: float, uncertainty: float) -> str:
    """In words, with the numbers, finely enough that one beyond the other is seen to be."""
    off, unsure = f"{1e3 * difference:z.1f}", f"± {1e3 * uncertainty:z.1f} mm"
    if quantity == "touch-down":
        return f"leg {leg} stands {off} {unsure} from where it was predicted"
    if quantity == "load":
        if np.isnan(measured):
            return f"what leg {leg} bears is not measured"
        if np.isnan(predicted):
            return f"leg {leg} bears {measured:z.0f} N, which was not predicted"
        return f"leg {leg} bears {measured:z.0f} N, predicted {predicted:z.0f} ± {uncertainty:z.0f} N"
    was, now = f"predicted {1e3 * predicted:z.1f}", f"by {1e3 * measured:z.1f} mm"
    if quantity == "drift":
        return f"the chassis moved {now}, {was} mm: it is {off} {unsure} from where it was predicted"
    return f"the chassis sank {now}, {was} {unsure}"
