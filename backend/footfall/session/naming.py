"""What a session may be called."""

from footfall.core.errors import InvalidInput

LONGEST = 80


def session_name(text: str) -> str:
    """A name as it is kept: without blanks at its ends, 1 to 80 printable characters. Raises InvalidInput."""
    name = text.strip()
    hidden = next((one for one in name if not one.isprintable()), None)
    if hidden is not None:
        raise InvalidInput(
            f"character {name.index(hidden) + 1} of the name (U+{ord(hidden):04X}) can't be printed: leave it out",
            character=f"U+{ord(hidden):04X}",
        )
    if not name:
        raise InvalidInput("the name is empty: give 1 to 80 printable characters", length=0)
    if len(name) > LONGEST:
        raise InvalidInput(
            f"the name has {len(name)} characters, at most {LONGEST} are kept: leave out {len(name) - LONGEST}",
            length=len(name),
        )
    return name
