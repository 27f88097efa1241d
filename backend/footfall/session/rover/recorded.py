"""What the rover said in a whole session, from its recordings, told short for plots; read in a process apart.

Reading takes an interpreter for seconds, so each answer reads a little more, and says how much is left: who asks again
has all of it in the end. What was read is kept in that process, files that were looked at long ago coarsely.
"""

import math
import time
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.io.recordings.track import SILENCE, Numbers, Track, first_time
from footfall.session.rover.recorder import recording_name
from footfall.telemetry.quantities import extremes

MOST_READ = 2 << 20
"""So much of the files is read for one answer [bytes], about a second's work."""
FINE = 8
"""Of so many files every frame is kept; what lies in more is told from blocks of frames."""
SHORTEST = 1e-3
"""A plot is at least so long [s]."""
KEPT = 256
"""Files of which anything is kept: those of four sessions that are full."""


@dataclass(frozen=True)
class RecordedTelemetry:
    """Times are seconds since 1970-01-01 UTC, by the server's clock; ``now`` is its clock when this was made.

    begin, end: of all that was recorded; null where nothing was. numbers: of each channel, one for each time; null
    where it is not known. silences: from when to when nothing was heard, those that can be seen at this size.
    unread: bytes that are still to be read; ask again. damaged: recordings whose end can't be read.
    """

    now: float
    begin: float | None
    end: float | None
    times: tuple[float, ...]
    numbers: tuple[tuple[float | None, ...], ...]
    silences: tuple[tuple[float, float], ...]
    unread: int
    damaged: tuple[str, ...]


class Tracks:
    """What is read of recordings, and kept. Not thread-safe."""

    def __init__(self) -> None:
        self._tracks: OrderedDict[Path, Track] = OrderedDict()

    @property
    def read(self) -> list[Path]:
        """The recordings that anything is kept of, by their names when they are finished."""
        return sorted(self._tracks)

    def looked_at(
        self,
        paths: Sequence[Path],
        channels: Sequence[tuple[str, int]],
        begin: float | None,
        end: float | None,
        parts: int,
        most: int = MOST_READ,
    ) -> RecordedTelemetry:
        """Channels (quantity, number from 0) between two times; None: from the first or to the last frame.

        paths: the recordings, oldest first. The time is cut into parts; of each come one or two moments with the least
        and the greatest number in it, and one moment more before and after all of them. Raises InvalidInput.
        """
        if begin is not None and end is not None and not begin < end:
            raise InvalidInput("the plot ends before it begins", begin=begin, end=end)
        starts = {path: start for path in paths if (start := _start(path)) is not None}
        if not starts:
            return RecordedTelemetry(time.time(), None, None, (), tuple(() for _ in channels), (), 0, ())
        *_, newest = starts
        wanted = _within(starts, begin, end)
        fine = len(wanted) <= FINE
        tracks: dict[Path, Track] = {}
        unread = 0
        for path in [newest, *(one for one in reversed(wanted) if one != newest)]:
            tracks[path], read, left = self._read(path, most, fine)
            most -= read
            unread += left
        first, last = min(starts.values()), _last(newest, tracks[newest])
        begin, end = first if begin is None else begin, last if end is None else end
        held = [tracks[path] for path in wanted if tracks[path].columns]
        found = _shortened(held, channels, begin, max(end, begin + SHORTEST), parts, fine)
        damaged = tuple(recording_name(path) for path in wanted if tracks[path].damaged)
        self._forget()
        return RecordedTelemetry(time.time(), first, last, *found, unread, damaged)

    def _read(self, path: Path, most: int, fine: bool) -> tuple[Track, int, int]:
        """The track of a file, how much of it was read now, and how much of it is left [bytes]."""
        key = path.with_name(recording_name(path))
        track = self._tracks.pop(key, None)
        if track is None or (fine and track.forgotten):
            track = Track()
        self._tracks[key] = track
        before, left = track.used, 0
        with suppress(OSError):  # it may be removed as the oldest, or finished, at this moment
            left = track.read_on(path if path.exists() else key, most)
        return track, track.used - before, left

    def _forget(self) -> None:
        while len(self._tracks) > KEPT:
            self._tracks.popitem(last=False)
        for track in list(self._tracks.values())[:-FINE]:
            track.forget()


_tracks = Tracks()


def recorded(
    paths: Sequence[Path], channels: Sequence[tuple[str, int]], begin: float | None, end: float | None, parts: int
) -> RecordedTelemetry:
    """See :meth:`Tracks.looked_at`; what this process has read before is kept."""
    return _tracks.looked_at(paths, channels, begin, end, parts)


def _start(path: Path) -> float | None:
    """When the first thing of a recording came; None where it has no whole chunk, or is removed."""
    with suppress(OSError, InvalidInput):
        return first_time(path)
    return None


def _last(path: Path, track: Track) -> float:
    """When the last frame came; of a file that is not read to its end, when it was written last."""
    written = path.stat().st_mtime if path.exists() else 0.0
    return float(track.times[-1]) if len(track.times) and track.caught_up else written


def _within(starts: dict[Path, float], begin: float | None, end: float | None) -> list[Path]:
    """The recordings that may have something between two times. A clock that was set back hides none."""
    following = [*list(starts.values())[1:], np.inf]
    return [
        path
        for (path, start), after in zip(starts.items(), following, strict=True)
        if (end is None or start <= end) and (begin is None or after >= begin or after < start)
    ]


def _shortened(
    tracks: Sequence[Track], channels: Sequence[tuple[str, int]], begin: float, end: float, parts: int, fine: bool
) -> tuple[tuple[float, ...], tuple[tuple[float | None, ...], ...], tuple[tuple[float, float], ...]]:
    """Times, numbers of each channel, and silences."""
    numbers = [_of(track, channels, fine) for track in tracks]
    if not numbers:
        return (), tuple(() for _ in channels), ()
    times, rows = (np.concatenate(several) for several in zip(*numbers, strict=True))
    heard = np.sort(np.concatenate([track.times for track in tracks]))
    in_order = np.argsort(times, kind="stable")
    times, rows = times[in_order], rows[in_order]
    inside = _with_neighbours(times, begin, end)
    times, rows = times[inside], rows[inside]
    part = np.clip(np.floor((times - begin) / (end - begin) * parts), -1, parts)
    edges = [*np.flatnonzero(np.diff(part, prepend=-2)).tolist(), len(times)]
    moments, least_and_greatest = extremes(times, rows, edges)
    columns = [[None if math.isnan(one) else one for one in column] for column in least_and_greatest.T.tolist()]
    heard = heard[_with_neighbours(heard, begin, end)]
    seen = np.flatnonzero(np.diff(heard) > max(SILENCE, (end - begin) / parts / 2))
    silences = zip(heard[seen].tolist(), heard[seen + 1].tolist(), strict=True)
    return tuple(moments.tolist()), tuple(map(tuple, columns)), tuple(silences)


def _of(track: Track, channels: Sequence[tuple[str, int]], fine: bool) -> Numbers:
    """Times and a column for each channel. Raises InvalidInput."""
    times, rows = track.fine if fine else track.coarse
    return times, rows[:, [track.column(quantity, number) for quantity, number in channels]]


def _with_neighbours(times: NDArray[np.float64], begin: float, end: float) -> slice:
    """Of times in order those within two, and one before and after."""
    first, following = np.searchsorted(times, begin, "left"), np.searchsorted(times, end, "right")
    return slice(max(0, int(first) - 1), int(following) + 1)
