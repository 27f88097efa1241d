"""URDF files, xacro expanded, as a tree of links and joints."""

import math
from collections.abc import Collection, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput, InvalidRobot, NotFound
from footfall.core.frames import rotation_from_quat_wxyz, rotation_rpy, transform
from footfall.core.written import number_of
from footfall.io.urdf.places import place_of
from footfall.io.urdf.safe_xml import parse
from footfall.io.urdf.shapes import box, cylinder, read_mesh, sphere
from footfall.robot.legged.tree import JOINT_KINDS, RobotTree, TreeJoint, TreeLink, TreeShape

XACRO = "xacro}"
"""How the namespaces of xacro end, of which there are several: http://ros.org/wiki/xacro, http://wiki.ros.org/xacro."""


def read_urdf(path: str | Path, folders: Sequence[str | Path] = ()) -> RobotTree:
    """The robot of a URDF file; folders: where packages are looked for besides the folders above it.

    Only collision meshes are opened. Raises NotFound where the file is not there, InvalidRobot for what can't be used.
    """
    path = Path(path)
    if not path.is_file():
        raise NotFound(f"there is no URDF {str(path)!r}")
    root = parse(path.read_bytes(), path.name)
    if root.tag != "robot":
        raise InvalidRobot(f"{path.name} is no URDF: its first element is <{root.tag}>, <robot> would be right")
    if any(XACRO in part.tag for part in root.iter()):
        raise InvalidRobot(f"{path.name} is xacro; expand it first: xacro {path.name} > robot.urdf")
    shapes = _Shapes(path, [Path(folder) for folder in folders])
    links = [_link(element, shapes) for element in root.findall("link")]
    if shapes.missing:
        raise InvalidRobot("; ".join(dict.fromkeys(shapes.missing)), missing=list(dict.fromkeys(shapes.missing)))
    joints = [_joint(element) for element in root.findall("joint")]
    return _tree(root.get("name") or path.stem, links, joints)


class _Shapes:
    """Collision shapes of one file: each mesh is read once, and the missing ones are told together."""

    def __init__(self, urdf: Path, folders: list[Path]) -> None:
        self._urdf, self._folders = urdf, folders
        self._meshes = {}
        self.missing: list[str] = []

    def of(self, collision: Element, where: str) -> TreeShape | None:
        """The shape of a <collision>; None where its mesh is missing."""
        T_link_shape = _origin(collision, where)
        geometry = collision.find("geometry")
        given = None if geometry is None else next(iter(geometry), None)
        if given is None:
            raise InvalidRobot(f"{where} has a collision without a shape; box, cylinder, sphere or mesh would be right")
        if given.tag == "box":
            size = _positive(_numbers(given, "size", 3, where), where)
            return TreeShape("box", T_link_shape, size, box(size))
        if given.tag == "sphere":
            radius = _positive(_numbers(given, "radius", 1, where), where)[0]
            return TreeShape("sphere", T_link_shape, np.full(3, radius), sphere(radius))
        if given.tag == "cylinder":
            radius, length = _positive(
                np.concatenate([_numbers(given, key, 1, where) for key in ("radius", "length")]), where
            )
            return TreeShape("cylinder", T_link_shape, np.array([radius, radius, length]), cylinder(radius, length))
        if given.tag != "mesh":
            raise InvalidRobot(f"{where} has a {given.tag} for collision; box, cylinder, sphere or mesh would be right")
        return self._of_mesh(given, T_link_shape, where)

    def _of_mesh(self, given: Element, T_link_shape: NDArray[np.float64], where: str) -> TreeShape | None:
        address = _text(given, "filename", where)
        scale = _numbers(given, "scale", 3, where) if given.get("scale") else np.ones(3)
        if not (np.isfinite(scale) & (scale != 0)).all():
            raise InvalidRobot(f"{where}: the scale of {address} must be finite and not zero")
        if address not in self._meshes:
            try:
                place = place_of(address, self._urdf, self._folders)
            except NotFound as err:
                self.missing.append(err.message)
                return None
            self._meshes[address] = read_mesh(place, address)
        mesh, unit = self._meshes[address]
        if unit != 1.0 and np.allclose(np.abs(scale), unit, rtol=1e-3):
            raise InvalidRobot(
                f"{where}: {address} says itself that its unit is {unit:g} m, and the URDF scales it by {unit:g} once "
                'more, which viewers multiply; take the scale out, or let the file say <unit meter="1"/>'
            )
        # a mirroring scale turns the surface inside out
        triangles = mesh.triangles[:, ::-1] if np.prod(scale) < 0 else mesh.triangles
        scaled = type(mesh)(mesh.vertices * scale, triangles)
        return TreeShape("mesh", T_link_shape, np.ptp(scaled.vertices, axis=0), scaled, address)


def _link(element: Element, shapes: _Shapes) -> TreeLink:
    name = _text(element, "name", "a link")
    where = f"link {name}"
    made = tuple(shapes.of(one, where) for one in element.findall("collision"))
    inertial = element.find("inertial")
    if inertial is None:
        return TreeLink(name, 0.0, np.zeros(3), np.zeros((3, 3)), tuple(one for one in made if one is not None))
    T_link_inertia = _origin(inertial, where)
    mass, moments = inertial.find("mass"), inertial.find("inertia")
    if mass is None:
        raise InvalidRobot(f"{where} has an inertial without a mass")
    given = np.zeros((3, 3))
    if moments is not None:
        xx, xy, xz, yy, yz, zz = (
            _number(moments, key, where, 0.0) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        given = np.array([(xx, xy, xz), (xy, yy, yz), (xz, yz, zz)])
    R = T_link_inertia[:3, :3]
    inertia = R @ given @ R.T
    kilograms = _number(mass, "value", where)
    return TreeLink(name, kilograms, T_link_inertia[:3, 3], inertia, tuple(one for one in made if one is not None))


def _joint(element: Element) -> TreeJoint:
    name = _text(element, "name", "a joint")
    where = f"joint {name}"
    kind = _text(element, "type", where)
    if kind not in JOINT_KINDS:
        raise InvalidRobot(f"{where} is {kind}; {', '.join(JOINT_KINDS)} are read, the base floats by itself")
    parent, child = (_text(_need(element, tag, where), "link", where) for tag in ("parent", "child"))
    axis = element.find("axis")
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else _numbers(axis, "xyz", 3, where)
    length = float(np.linalg.norm(direction))
    if kind != "fixed" and not 1e-6 < length < np.inf:
        raise InvalidRobot(f"{where} has the axis {direction.tolist()}; a direction would be right")
    limit, mimic = element.find("limit"), element.find("mimic")
    nan = math.nan
    lower = upper = effort = velocity = nan
    if limit is not None:
        effort, velocity = (_number(limit, key, where, nan) for key in ("effort", "velocity"))
        if kind in ("revolute", "prismatic") and (limit.get("lower") or limit.get("upper")):
            # either one left out is zero, as urdfdom has it
            lower, upper = (_number(limit, key, where, 0.0) for key in ("lower", "upper"))
            soft_lower, soft_upper = _soft_limits(element, where)
            lower, upper = max(lower, soft_lower), min(upper, soft_upper)
    return TreeJoint(
        name,
        kind,
        parent,
        child,
        _origin(element, where),
        direction / length if length else direction,
        lower,
        upper,
        effort,
        velocity,
        "" if mimic is None else _text(mimic, "joint", where),
        1.0 if mimic is None else _number(mimic, "multiplier", where, 1.0),
        0.0 if mimic is None else _number(mimic, "offset", where, 0.0),
    )


def _soft_limits(element: Element, where: str) -> tuple[float, float]:
    """Where the controller of a joint lets it go no farther, whatever is commanded; without a gain it lets it."""
    safety = element.find("safety_controller")
    soft = ("soft_lower_limit", "soft_upper_limit")
    if safety is None or not any(map(safety.get, soft)) or not _number(safety, "k_position", where, 0.0) > 0:
        return -math.inf, math.inf
    # either one left out is zero, as urdfdom has it
    lower, upper = (_number(safety, key, where, 0.0) for key in soft)
    return lower, upper


def _tree(name: str, links: list[TreeLink], joints: list[TreeJoint]) -> RobotTree:
    """Links and joints, parents first. Raises InvalidRobot naming what keeps them from being one tree."""
    _check_called_once(name, links, joints)
    by_name = {link.name: link for link in links}
    carried = _carried(name, by_name, joints)
    _check_mimics(name, joints)
    if not links:
        raise InvalidRobot(f"{name} has no link, so there is no robot in it")
    roots = [link for link in links if link.name not in carried]
    if len(roots) != 1:
        names = ", ".join(link.name for link in roots) or "none: its joints go round in a cycle"
        raise InvalidRobot(f"{name}: a robot has one root link, this one has {names}")
    ordered, reached = [], [roots[0].name]
    for link in reached:
        own = [joint for joint in joints if joint.parent == link]
        ordered += own
        reached += [joint.child for joint in own]
    lost = [link.name for link in links if link.name not in reached]
    if lost:
        raise InvalidRobot(f"{name}: {', '.join(lost)} hang in a cycle that the root {roots[0].name} does not carry")
    return RobotTree(name, tuple(by_name[one] for one in reached), tuple(ordered))


def _check_called_once(name: str, links: list[TreeLink], joints: list[TreeJoint]) -> None:
    for what, names in (("links", [link.name for link in links]), ("joints", [joint.name for joint in joints])):
        twice = sorted({one for one in names if names.count(one) > 1})
        if twice:
            raise InvalidRobot(f"{name}: two {what} are called {twice[0]}")


def _carried(name: str, links: Collection[str], joints: list[TreeJoint]) -> dict[str, str]:
    """Link → the joint that it hangs from. links: the names that there are."""
    carried: dict[str, str] = {}
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise InvalidRobot(f"{name}: joint {joint.name} names the link {link}, which is not there")
        if joint.child in carried:
            raise InvalidRobot(
                f"{name}: link {joint.child} hangs from two joints, {carried[joint.child]} and {joint.name}"
            )
        carried[joint.child] = joint.name
    return carried


def _check_mimics(name: str, joints: list[TreeJoint]) -> None:
    follows = {joint.name: joint.mimic for joint in joints if joint.moves}
    for joint in joints:
        seen, leader = {joint.name}, joint.mimic
        while leader:
            if leader not in follows:
                raise InvalidRobot(f"{name}: joint {joint.name} mimics {leader}, which is no joint that moves")
            if leader in seen:
                raise InvalidRobot(f"{name}: joint {joint.name} mimics itself by way of {leader}")
            seen.add(leader)
            leader = follows[leader]


def _origin(element: Element, where: str) -> NDArray[np.float64]:
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    xyz, rpy = (_numbers(origin, key, 3, where) if origin.get(key) else np.zeros(3) for key in ("xyz", "rpy"))
    if not np.isfinite([xyz, rpy]).all():
        raise InvalidRobot(f"{where} has an origin that is not finite")
    return transform(_turn(origin, where) if origin.get("quat_xyzw") else rotation_rpy(*rpy), xyz)


def _turn(origin: Element, where: str) -> NDArray[np.float64]:
    """The rotation of an origin that says it as a quaternion, as URDF 1.1 may."""
    if origin.get("rpy"):
        raise InvalidRobot(f"{where} has an origin with rpy and quat_xyzw; either of them would be right")
    *vector, w = _numbers(origin, "quat_xyzw", 4, where)
    try:
        return rotation_from_quat_wxyz([w, *vector])
    except InvalidInput as err:
        said = origin.get("quat_xyzw")
        raise InvalidRobot(f"{where} has the quat_xyzw {said!r}; one of length 1 would be right") from err


def _positive(sizes: NDArray[np.float64], where: str) -> NDArray[np.float64]:
    if not (np.isfinite(sizes) & (sizes > 0)).all():
        raise InvalidRobot(f"{where} has a collision shape of size {sizes.tolist()}; above zero would be right [m]")
    return sizes


def _need(element: Element, tag: str, where: str) -> Element:
    found = element.find(tag)
    if found is None:
        raise InvalidRobot(f"{where} lacks its <{tag}>")
    return found


def _text(element: Element, key: str, where: str) -> str:
    text = element.get(key)
    if not text:
        raise InvalidRobot(f"{where}: <{element.tag}> lacks {key}")
    return text


def _number(element: Element, key: str, where: str, otherwise: float | None = None) -> float:
    if otherwise is not None and element.get(key) is None:
        return otherwise
    return float(_numbers(element, key, 1, where)[0])


def _numbers(element: Element, key: str, count: int, where: str) -> NDArray[np.float64]:
    text = _text(element, key, where)
    words = [number_of(word) for word in text.split()]
    numbers = np.array([word for word in words if word is not None])
    if not len(numbers) == len(words) == count:
        wanted = "a number" if count == 1 else f"{count} numbers"
        raise InvalidRobot(f"{where}: {key} of <{element.tag}> is {text[:60]!r}; {wanted} would be right")
    return numbers
