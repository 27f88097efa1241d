"""What the numbers of recorded frames tell: how many came, how many are missing, how often counting began anew."""

from dataclasses import dataclass

from footfall.telemetry.state import counted_anew


@dataclass
class Continuity:
    """Counts as :class:`footfall.session.rover.link.RoverLink` does.

    frames: recorded; gaps: numbers that are missing between them; restarts: how often counting began anew.
    dropped: what the recorder itself could not take (frames among it are missing numbers too).
    """

    frames: int = 0
    gaps: int = 0
    restarts: int = 0
    dropped: int = 0
    _latest: int | None = None

    def take(self, number: int) -> None:
        """The next frame."""
        if self._latest is not None:
            if counted_anew(self._latest, number):
                self.restarts += 1
            else:
                self.gaps += number - self._latest - 1
        self.frames += 1
        self._latest = number

    def as_dict(self) -> dict[str, int]:
        """Plain JSON."""
        return {"frames": self.frames, "gaps": self.gaps, "restarts": self.restarts, "dropped": self.dropped}
