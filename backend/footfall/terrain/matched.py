"""The pairs of a snapshot, matched: disparities and how sure they are, or why a pair can't be used."""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidImages
from footfall.core.pipelined import pipelined
from footfall.core.progress import Progress, no_progress
from footfall.telemetry.images import ImagePair
from footfall.terrain.pairs import stereo
from footfall.terrain.pairs.epipolar import PairAlignment, align_pair, fits
from footfall.terrain.pairs.rectify import require_simultaneous
from footfall.terrain.terrain_settings import TerrainSettings

Exchange = Callable[[str], ImagePair]
"""From a pair's name to that pair rectified with its two images exchanged."""

_SWAPPED = "left and right seem to be swapped: exchanged, the images match"


class Matched(NamedTuple):
    """A pair, its disparities, NaN where unknown, and their standard deviations, (height, width) [px].

    slopes: by how much the disparity changes to the next column and row on the surface of each pixel, (height, width)
    each [px]. kinds: (height, width), how pixels lie to the robot, see :mod:`footfall.terrain.rover_mask.taken_out`.
    """

    pair: ImagePair
    disparity: NDArray[np.float32]
    deviation: NDArray[np.float32]
    slopes: tuple[NDArray[np.float32], NDArray[np.float32]]
    kinds: NDArray[np.uint8]


def match_pairs(
    pairs: Sequence[ImagePair],
    settings: TerrainSettings,
    progress: Progress = no_progress,
    left_out: Mapping[str, str] | None = None,
    exchange: Exchange | None = None,
) -> tuple[list[Matched], str, dict[str, str]]:
    """Disparities of all pairs that can be used, what to call their map, and why each other pair was left out.

    Args:
        pairs: rectified.
        settings: how they are matched, and which are taken.
        progress: called with a fraction 0…1 and a text; what it raises ends the work.
        left_out: pairs that could not be used before, with the reasons; None: none.
        exchange: of pairs that were not taken rectified: tells swapped images; None: nothing does.

    Returns:
        The pairs with their disparities, the name, and name → why it was left out.

    Raises:
        InvalidImages: no pair is left.
        InvalidInput: the settings name a pair that is not there.
    """
    matched: list[Matched] = []
    reasons = dict(left_out or {})
    not_chosen = settings.not_chosen([*reasons, *(pair.name for pair in pairs)])
    reasons |= {name: f"pair {name}: not chosen" for name in not_chosen}
    pairs = [pair for pair in pairs if pair.name not in not_chosen]
    brief = [f"{name} ({_briefly(name, reason)})" for name, reason in reasons.items()]
    alignments: list[str] = []

    def aligned(pair: ImagePair) -> tuple[ImagePair, PairAlignment]:
        require_simultaneous(pair.name, pair.time, pair.time_right, settings.max_skew)
        return align_pair(pair)

    with closing(pipelined(aligned, pairs)) as following:
        for i, (pair, alignment_of_it) in enumerate(following):
            progress(0.7 * i / len(pairs), f"matching {pair.name}")
            try:
                pair, alignment = alignment_of_it.result()
                found = stereo.match(pair, settings)
            except InvalidImages as err:
                swapped = exchange is not None and fits(exchange(pair.name))
                reason = f"pair {pair.name}: {_SWAPPED}" if swapped else err.message
                short = None if swapped else err.details.get("brief")
                reasons[pair.name] = reason
                brief.append(f"{pair.name} ({short or _briefly(pair.name, reason)})")
                continue
            if alignment.corrected or not alignment.checked:
                alignments.append(alignment.text)
            deviation, apart = stereo.deviations(found, pair, settings), np.zeros(found.disparity.shape, np.uint8)
            matched.append(Matched(pair, found.disparity, deviation, (found.along, found.down), apart))
    if not matched:
        raise InvalidImages("no image pair can be used: " + "; ".join(reasons.values()), pairs=reasons)
    name = "images, 1 pair" if len(matched) == 1 else f"images, {len(matched)} pairs"
    if alignments:
        name += f", {', '.join(alignments)}"
    if brief:
        name += f", without {', '.join(brief)}"
    return matched, name, reasons


def _briefly(pair: str, reason: str) -> str:
    """The first clause of why a pair was left out."""
    return re.split(r"[;:,(]", reason.removeprefix(f"pair {pair}: "))[0].strip()
