"""Reading a robot.toml back: which legs a person says the robot of a URDF has."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot, NotFound
from footfall.core.misread import Unreadable, place_of
from footfall.core.written import utf8_of
from footfall.io.urdf.camera_tables import camera_pairs
from footfall.io.urdf.read import read_urdf
from footfall.robot.description import CameraPairSpec
from footfall.robot.legged.find_legs import chain_to
from footfall.robot.legged.judge_tree import joined_inertia
from footfall.robot.legged.legged_model import LegChain, LeggedModel, Sole
from footfall.robot.legged.tree import RobotTree, TreeJoint, TreeLink
from footfall.robot.table import Table

TOP = "name urdf packages base mass_check joints payload cameras legs postures clearances collisions"
JOINT, PAYLOAD = "lower upper effort velocity stiffness", "name link mass center"
LIMITS = frozenset({"lower", "upper"})
LEG = "name foot joints group sole center radius width axis polygon"
SHORTEST, ROUNDED = 1e-6, 1e-5
"""Of a direction: shorter is none, and nearer to one is one."""


@dataclass(frozen=True)
class Proposed:
    """A robot.toml: the tree of its URDF, its legs, named postures (joint → angle) and what the robot weighs [kg].

    What it carries counts to its tree and to what it weighs. clearances: least distances by name [m]; always: pairs of
    links that touch as they are built. cameras: pairs on the chassis.
    """

    model: LeggedModel
    mass_check: float
    postures: Mapping[str, Mapping[str, float]]
    clearances: Mapping[str, float]
    always: tuple[tuple[str, str], ...]
    cameras: tuple[CameraPairSpec, ...] = ()


def read_proposed(path: str | Path) -> Proposed:
    """Read a robot.toml and the URDF that it names.

    Raises NotFound where a file is not there, InvalidRobot naming the entry that can't be used.
    """
    path = Path(path)
    if not path.is_file():
        raise NotFound(f"there is no robot description {str(path)!r}")
    try:
        table = Table(tomllib.loads(utf8_of(path.read_bytes())), "")
    except (tomllib.TOMLDecodeError, Unreadable) as err:
        raise InvalidRobot(f"{path.name} is not readable TOML{place_of(err)}") from err
    table.only(TOP)
    folders = [path.parent / folder for folder in table.texts("packages")]
    tree = _with_joints(read_urdf(path.parent / table.text("urdf"), folders), table)
    tree = replace(tree, name=table.text("name") if "name" in table else tree.name)
    if table.text("base") != tree.root:
        raise InvalidRobot(f"base is {table.text('base')!r}, and the root link of the URDF is {tree.root!r}")
    mass = table.number("mass_check")
    if not mass > 0:
        raise InvalidRobot("mass_check must be above zero [kg]", mass_check=mass)
    clearances = _clearances(table.table("clearances"))
    always = _always(table.table("collisions"), tree)
    loads = table.tables("payload") if "payload" in table else []
    bare = tree.mass
    for load in loads:
        tree = _carrying(tree, load)
    model = LeggedModel(tree, tree.root, tuple(_leg(one, tree) for one in table.tables("legs")), {})
    postures = table.table("postures")
    named = {name: _posture(postures.table(name)) for name in postures}
    cameras = camera_pairs(table.tables("cameras"), model, named) if "cameras" in table else ()
    return Proposed(model, mass + tree.mass - bare, named, clearances, always, cameras)


def _with_joints(tree: RobotTree, table: Table) -> RobotTree:
    """The tree with what the file says of joints: it counts where the URDF says otherwise, or nothing."""
    if "joints" not in table:
        return tree
    said, names = table.table("joints"), {joint.name for joint in tree.joints if joint.moves}
    unknown = next((name for name in said if name not in names), None)
    if unknown is not None:
        raise InvalidRobot(f"joints: the URDF has no joint {unknown!r} that moves")
    joints = tuple(_joint(said.table(joint.name), joint) if joint.name in said else joint for joint in tree.joints)
    return replace(tree, joints=joints)


def _joint(table: Table, joint: TreeJoint) -> TreeJoint:
    table.only(JOINT)
    found = {name: table.number(name) for name in table}
    for name, size in found.items():
        if name not in LIMITS and not size > 0:
            raise InvalidRobot(f"{table.where}.{name} must be above zero", **{name: size})
    said = replace(joint, **found)
    return _with_limits(table, said) if found.keys() & LIMITS else said


def _with_limits(table: Table, joint: TreeJoint) -> TreeJoint:
    """The joint, both of whose limits are known now; one that turned without end is revolute with them."""
    for name, limit in (("lower", joint.lower), ("upper", joint.upper)):
        if not np.isfinite(limit):
            raise InvalidRobot(f"{table.where} needs both limits: the URDF says no {name} of {joint.name}")
    if not joint.lower < joint.upper:
        raise InvalidRobot(
            f"{table.where}: its lower limit must be below its upper one", lower=joint.lower, upper=joint.upper
        )
    return replace(joint, kind="revolute" if joint.kind == "continuous" else joint.kind)


def _carrying(tree: RobotTree, table: Table) -> RobotTree:
    """The tree with a load on one of its links, as a point that weighs."""
    table.only(PAYLOAD)
    name, link, mass = table.text("name"), table.text("link"), table.number("mass")
    if link not in {one.name for one in tree.links}:
        raise InvalidRobot(f"payload {name}: the URDF has no link {link!r}")
    if not mass > 0:
        raise InvalidRobot(f"payload {name}: its mass must be above zero [kg]", mass=mass)
    bare = tree.link(link)
    load = TreeLink(name, mass, table.numbers("center", 3), np.zeros((3, 3)), ())
    total, center, inertia = joined_inertia([(np.eye(4), bare), (np.eye(4), load)])
    loaded = replace(bare, mass=total, center=center, inertia=inertia)
    return replace(tree, links=tuple(loaded if one.name == link else one for one in tree.links))


def _leg(table: Table, tree: RobotTree) -> LegChain:
    table.only(LEG)
    name, foot, joints = table.text("name"), table.text("foot"), table.texts("joints")
    if foot not in tree.bodies():
        raise InvalidRobot(f"leg {name}: the URDF has no link {foot!r}")
    chain = tuple(joint.name for joint in chain_to(tree, foot) if joint.moves)
    if joints != chain:
        listed = ", ".join(chain) or "none"
        raise InvalidRobot(
            f"leg {name}: the moving joints from {tree.root} to {foot} are {listed}, not {', '.join(joints)}"
        )
    if len(chain) < 2:
        raise InvalidRobot(f"leg {name}: {len(chain)} joint that moves can't place a foot; at least 2 are needed")
    return LegChain(name, joints, foot, _sole(table), table.integer("group"))


def _sole(table: Table) -> Sole:
    kind = table.text("sole")
    needs = {"wheel": ("radius", "width", "axis"), "ball": ("radius",), "flat": ("axis", "polygon")}.get(kind, ())
    given = {
        "radius": table.number("radius") if "radius" in needs else 0.0,
        "width": table.number("width") if "width" in needs else 0.0,
        "axis": _direction(table) if "axis" in needs else np.zeros(3),
        "polygon": table.corners("polygon") if "polygon" in needs else np.zeros((0, 3)),
    }
    for key in ("radius", "width"):
        if key in needs and not given[key] > 0:
            raise InvalidRobot(f"{table.where}.{key} must be above zero [m]")
    return Sole(kind, table.numbers("center", 3), **given)


def _direction(table: Table) -> Array:
    """The axis, one long; one that was rounded stays as it is written. Raises InvalidRobot for one without length."""
    axis = table.numbers("axis", 3)
    length = float(np.linalg.norm(axis))
    if not length > SHORTEST:
        raise InvalidRobot(f"{table.where}.axis is {axis.tolist()}; a direction would be right")
    return axis if abs(length - 1.0) < ROUNDED else axis / length


def _posture(table: Table) -> dict[str, float]:
    return {joint: table.number(joint) for joint in table}


def _clearances(table: Table) -> dict[str, float]:
    table.only("other_leg own_leg base ground")
    found = {name: table.number(name) for name in table}
    for name, distance in found.items():
        if distance < 0:
            raise InvalidRobot(f"clearances.{name} must not be negative [m]", distance=distance)
    return found


def _always(table: Table, tree: RobotTree) -> tuple[tuple[str, str], ...]:
    """Pairs that touch as they are built; those that never do are read for their names alone."""
    table.only("samples seed always never")
    links = set(tree.bodies())
    for key in ("always", "never"):
        for pair in table.pairs(key):
            for link in pair:
                if link not in links:
                    raise InvalidRobot(f"collisions.{key}: the URDF has no link {link!r}")
    return tuple((pair[0], pair[1]) for pair in table.pairs("always"))
