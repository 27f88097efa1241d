"""What sessions do with robots that others described, and how all else is refused."""

from footfall.core.errors import InvalidInput

WORKS_IN_SESSIONS = (
    "stances, maps, steps (described-steps), walks (described-walks), routes, commands made of them, sending, stop, "
    "replay, and files of json, csv, seqjson, fprime and ros2"
)


def athletes_alone(name: str) -> InvalidInput:
    """The refusal of what takes ATHLETE's legs alone, in a session about the robot of that name."""
    return InvalidInput(
        f"this takes ATHLETE's legs alone, and the session is about {name}; for it there are {WORKS_IN_SESSIONS}"
    )
