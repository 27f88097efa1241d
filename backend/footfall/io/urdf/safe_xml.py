"""XML from strangers: no document types, no entities, bounded in size and depth."""

from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from footfall.core.errors import InvalidRobot
from footfall.core.misread import place_of

MAX_BYTES = 20_000_000
MAX_DEPTH = 64


class _Bounded(TreeBuilder):
    """Builds elements, refuses document types (and with them every entity of their own) and deep nesting."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def start(self, tag, attrs, /):
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise InvalidRobot(f"its elements are nested deeper than {MAX_DEPTH}; a robot needs about five")
        return super().start(tag, attrs)

    def end(self, tag, /):
        self._depth -= 1
        return super().end(tag)

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise InvalidRobot("it declares a document type or entities; a URDF needs none: take <!DOCTYPE …> out")


def parse(content: bytes, name: str) -> Element:
    """The root element of an XML file. Raises InvalidRobot naming the file."""
    if len(content) > MAX_BYTES:
        raise InvalidRobot(f"{name} has {len(content)} bytes, more than {MAX_BYTES} are refused")
    parser = XMLParser(target=_Bounded())
    try:
        parser.feed(content)
        return parser.close()
    except InvalidRobot as err:
        raise InvalidRobot(f"{name} is refused: {err.message}") from err
    except (ParseError, ValueError, LookupError) as err:
        raise InvalidRobot(f"{name} is not readable XML{place_of(err)}") from err
