"""The kinds of commands that a rover knows, one entry each: its name on the wire and what it takes.

Link, rules, edits, exports, imports and simulated rovers read these entries; no other module spells a name.
``docs/rover-link.md`` tells rovers what each does. A new kind is an entry here, and what it does where commands are
followed: ``sequence/passage.py``, ``sequence/yielding.py`` and the rovers of ``sim``.
"""

from dataclasses import dataclass

JOINTS_OF_LEG = 6


@dataclass(frozen=True, eq=False)
class Argument:
    """What a command takes; a field of ``Command`` and of ``CommandMessage`` holds it by this name.

    unit: "" for a count. means: for whoever reads a dictionary of commands, with the unit.
    """

    name: str
    unit: str
    means: str

    @property
    def column(self) -> str:
        """Its name with the unit, for tables."""
        return f"{self.name}_{self.unit}" if self.unit else self.name


LEG = Argument("leg", "", "leg, counted from 0")
LEG_ANGLES = Argument("joints", "rad", "target angles [rad]")
"""One angle for each joint of the leg."""
ALL_ANGLES = Argument("joints", "rad", "target angles of all legs [rad], leg by leg")
DURATION = Argument("duration", "s", "from its start to its end [s]")
FORCE = Argument("force", "N", "rise of the wheel's force along the site's up that ends it [N]")


@dataclass(frozen=True, eq=False)
class CommandKind:
    """One kind of command.

    name: on the wire, in files and in digests. code: its number in binary dictionaries; neither ever changes.
    does: in a few words. arguments: in their order, which counts in formats whose arguments have no names.
    """

    name: str
    code: int
    does: str
    arguments: tuple[Argument, ...]

    @property
    def argument_names(self) -> tuple[str, ...]:
        """The names of what it takes, in order."""
        return tuple(argument.name for argument in self.arguments)

    @property
    def names_leg(self) -> bool:
        """Whether it moves the one leg that it names."""
        return LEG in self.arguments

    @property
    def moves_all(self) -> bool:
        """Whether it moves the joints of all legs together, and with them the chassis."""
        return ALL_ANGLES in self.arguments

    @property
    def moves(self) -> bool:
        """Whether it moves any joint."""
        return self.moves_all or LEG_ANGLES in self.arguments

    @property
    def ends_by_force(self) -> bool:
        """Whether it is done as soon as the wheel of its leg bears more."""
        return FORCE in self.arguments

    def joint_count(self, leg_count: int) -> int:
        """How many angles it takes, of a rover with so many legs."""
        if self.moves_all:
            return JOINTS_OF_LEG * leg_count
        return JOINTS_OF_LEG if self.moves else 0

    def joints_of(self, leg: int | None, leg_count: int) -> slice:
        """Which joints of a posture (legs × 6,) it moves. leg: the one that it names."""
        first = JOINTS_OF_LEG * leg if self.names_leg and leg is not None else 0
        return slice(first, first + self.joint_count(leg_count))


LEG_MOVE = CommandKind("LEG_MOVE", 0, "one leg in a straight joint-space line", (LEG, LEG_ANGLES, DURATION))
WAIT = CommandKind("WAIT", 1, "nothing moves", (DURATION,))
POSTURE_MOVE = CommandKind("POSTURE_MOVE", 2, "all joints in one straight joint-space line", (ALL_ANGLES, DURATION))
LEG_LOWER = CommandKind(
    "LEG_LOWER", 3, f"like {LEG_MOVE.name}, done when the wheel bears more", (LEG, LEG_ANGLES, DURATION, FORCE)
)

KINDS = {kind.name: kind for kind in (LEG_MOVE, WAIT, POSTURE_MOVE, LEG_LOWER)}
"""name → kind, in the order of their codes."""

UNKNOWN = CommandKind("", -1, "what no rover knows; it breaks the rule known-command", ())


def kind_named(name: str) -> CommandKind:
    """The kind of that name; UNKNOWN where there is none."""
    return KINDS.get(name, UNKNOWN)
