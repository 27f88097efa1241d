"""What the server holds for those who ask, in bytes or pixels: of each of them, and in all. Not thread-safe."""

from collections import Counter


class Budget:
    """in_all, of_one: the most that is held, of everybody together and of one client."""

    def __init__(self, in_all: int, of_one: int) -> None:
        self.in_all, self.of_one = in_all, of_one
        self._held: Counter[str] = Counter()

    @property
    def held(self) -> int:
        """Of everybody together."""
        return self._held.total()

    def of(self, client: str) -> int:
        """Of one client."""
        return self._held[client]

    def takes(self, client: str, size: int) -> bool:
        """Hold so much more for a client, if there is room."""
        if self._held[client] + size > self.of_one or self.held + size > self.in_all:
            return False
        self._held[client] += size
        return True

    def takes_one(self, client: str, size: int) -> bool:
        """As :meth:`takes`; what is too large for any share is taken where nothing else is held for that client."""
        if self._held[client] == 0:
            self._held[client] = size
            return True
        return self.takes(client, size)

    def give_back(self, client: str, size: int) -> None:
        """So much is held no more."""
        self._held[client] -= size
        if self._held[client] <= 0:
            del self._held[client]
