"""The last few results, by the content they were made from.

Unlike functools.lru_cache it keeps no argument alive: a map may be hundreds of times larger than what is made of it.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

_Result = TypeVar("_Result")


class LatestResults(Generic[_Result]):
    """At most so many results; the one that was asked for longest ago goes first."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._results: OrderedDict[Hashable, _Result] = OrderedDict()

    def get(self, content: Hashable, make: Callable[[], _Result]) -> _Result:
        """The result kept for this content, or what ``make`` returns, kept from now on."""
        try:
            result = self._results.pop(content)
        except KeyError:
            result = make()
        self._results[content] = result
        while len(self._results) > self._most:
            self._results.popitem(last=False)
        return result
