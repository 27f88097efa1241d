"""Notes on the types of answers: what plain types can't say. What describes answers to others reads them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Each:
    """Note of a member of a TypedDict: it stands for members of its type with these names, in its place."""

    names: Callable[[], Iterable[str]]


@dataclass(frozen=True)
class OneOf:
    """Note of a text: it is one of these."""

    names: Callable[[], Iterable[str]]


@dataclass(frozen=True)
class Says:
    """Note of any member: what it is, in words."""

    text: str


DigestText = Annotated[str, Says("name of a product by its content")]
