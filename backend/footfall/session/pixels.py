"""How many pixels of images from outside are in memory at once, of each client and in all. Asked before unpacking.

A picture of nothing unpacks to a thousand times its size. It is held while it is unpacked, looked at and stored, and,
of a rover with a light time, until that is over.
"""

import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

from footfall.core.errors import Busy, InvalidImages
from footfall.session.budget import Budget

OF_ONE, IN_ALL = 200_000_000, 300_000_000
"""Pixels that are held of one client, and of all together."""
RETRY_AFTER = 5
"""Who was refused may ask again after so long [s]."""


class PixelBudget:
    """Thread-safe. of_one, in_all: most pixels of one client, and of all together."""

    def __init__(self, of_one: int = OF_ONE, in_all: int = IN_ALL) -> None:
        self._budget = Budget(in_all, of_one)
        self._guard = threading.Lock()

    @property
    def held(self) -> int:
        """Of everybody together."""
        return self._budget.held

    def of(self, client: str) -> "HeldPixels":
        """What a client holds for one request, none yet; a context that gives it back."""
        return HeldPixels(self, client)

    def take(self, client: str, pixels: int) -> None:
        """Hold so many more. Raises InvalidImages for what never fits, Busy where it does not fit now."""
        with self._guard:
            budget = self._budget
            if pixels > budget.of_one:
                raise InvalidImages(
                    f"the images have {pixels} pixels; of one client at most {budget.of_one} are unpacked at once: "
                    "send fewer, or smaller ones",
                    pixels=pixels,
                    limit=budget.of_one,
                )
            if budget.takes(client, pixels):
                return
            own = budget.of(client)
            theirs = own + pixels > budget.of_one
            whose, held, limit = ("this client", own, budget.of_one) if theirs else ("all", budget.held, budget.in_all)
        raise Busy(
            f"the images have {pixels} pixels, and {held} of {whose} are being worked on, or on their way while the "
            f"light time lasts; at most {limit} are held at once: send them again when others have ended, or fewer",
            pixels=pixels,
            held=held,
            limit=limit,
            fault="images",
            retry_after=RETRY_AFTER,
        )

    def give_back(self, client: str, pixels: int) -> None:
        """So many are held no more."""
        with self._guard:
            self._budget.give_back(client, pixels)


class HeldPixels:
    """Pixels of one request. They are given back where it ends, however it ends, unless they were handed on."""

    def __init__(self, budget: PixelBudget, client: str) -> None:
        self._budget, self._client = budget, client
        self._pixels = 0

    def take(self, pixels: int) -> None:
        """Hold so many more, before they are unpacked. Raises as :meth:`PixelBudget.take`."""
        self._budget.take(self._client, pixels)
        self._pixels += pixels

    def hand_on(self) -> Callable[[], None]:
        """They outlive the request: what is to be called once when they are held no more."""
        pixels, self._pixels = self._pixels, 0
        return lambda: self._budget.give_back(self._client, pixels)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.hand_on()()
