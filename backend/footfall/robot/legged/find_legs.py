"""Which limbs of a robot's tree are legs, told from arms, sensors and hands by how the tree hangs and where it ends."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidRobot
from footfall.core.frames import apply, inverse
from footfall.robot.legged.groups import grouped
from footfall.robot.legged.legged_model import LegChain, LeggedModel, Sole
from footfall.robot.legged.soles import sole_of
from footfall.robot.legged.touching import sampled
from footfall.robot.legged.tree import RobotTree, TreeJoint, TreeLink

HIGH = 0.3
"""A limb whose end stays this share of the robot's height above the feet is no leg."""
DOUBTFUL = 0.15
AT_FOOT = 0.5
"""Of how far a leg's last body reaches: a shape that ends nearer to the joint is a part of the shank, no foot."""
DRAWN, SEED = 200, 0
"""Postures in which is looked how low a limb gets."""


@dataclass(frozen=True)
class _Limb:
    """A chain of moving joints from the base to one end.

    lowest: height of its last body's lowest point, begins: of its first joint [m].
    """

    joints: tuple[TreeJoint, ...]
    forks: bool
    lowest: float
    begins: float


def legged_model(tree: RobotTree, hanging: bool = False) -> LeggedModel:
    """Base, legs, feet and groups of a robot.

    Args:
        tree: its links and joints.
        hanging: whether each limb is judged where its joints let its end hang lowest, of DRAWN postures; else in the
            posture in the middle.

    Returns:
        The robot with its legs.

    Raises:
        InvalidRobot: there are fewer than three legs or more than twelve; of every other limb it says why it is none.
    """
    Ts_root_link = tree.poses(tree.neutral())
    limbs = [_limb(tree, joint, Ts_root_link) for joint in tree.joints if joint.moves and _carried_by_base(tree, joint)]
    lowest = [Ts_root_link] * len(limbs)
    if hanging or all(limb.lowest >= 0 for limb in limbs):
        lowest = _lowest_of_drawn(tree, limbs)
    if hanging:
        limbs = [_limb(tree, limb.joints[0], Ts) for limb, Ts in zip(limbs, lowest, strict=True)]
    if not limbs:
        raise InvalidRobot(f"{tree.name} has no joint that moves, so no legs; a legged robot needs 3 to 12")
    chains = [limb for limb in limbs if _why_not(limb) == ""]
    ground = min((limb.lowest for limb in chains), default=0.0)
    height = max(-ground, 1e-9)  # of the root's frame
    legs: list[LegChain] = []
    left_out: dict[str, str] = {}
    for limb, Ts in zip(limbs, lowest, strict=True):
        above = (limb.lowest - ground) / height
        why = _why_not(limb)
        if not why and ground >= 0:
            why = "it does not reach below the base"
            down = _lowest(tree, limb.joints[-1].child, Ts)
            if -down > max(limb.begins, 0.0):
                why += (
                    f" with its joints in the middle, and {-down:z.2f} m below it as low as they let it: "
                    "where it is a leg, footfall robot init --hanging takes it so"
                )
        elif not why and above > HIGH:
            why = f"its end stays {limb.lowest - ground:z.2f} m above the lowest"
        doubt = f"its end is {limb.lowest - ground:z.3f} m above the lowest foot" if above > DOUBTFUL else ""
        low = ""
        if limb.lowest < limb.begins and limb.begins > -ground:
            low = (
                f"the frame of the root link {tree.root} lies {limb.begins:z.2f} m below it: where that is the ground, "
                "as base_footprint is, take the link out, so that the chassis is the root"
            )
        if why:
            left_out[f"{limb.joints[0].name} … {limb.joints[-1].name}"] = "; ".join(filter(None, (why, low)))
            continue
        legs.append(_leg(tree, limb, Ts, "; ".join(filter(None, (doubt, low)))))
    return LeggedModel(tree, tree.root, grouped(tree, _named(legs)), left_out)


def foot_of(tree: RobotTree, last: TreeJoint) -> str:
    """The foot link of a limb that ends with that joint: the end of its last body that lies farthest from the joint.

    Ends with a collision shape come before bare frames, but for shapes near the joint: see AT_FOOT.
    """
    members = tree.members(last.child)
    Ts_root_link = tree.poses({})
    start = Ts_root_link[last.child][:3, 3]
    carriers = {joint.parent for joint in tree.joints}
    ends = [link for link in members if link.name not in carriers] or [tree.link(last.child)]

    def far(link: TreeLink) -> float:
        return float(np.linalg.norm(Ts_root_link[link.name][:3, 3] - start))

    def reach(link: TreeLink) -> float:
        parts = [apply(Ts_root_link[link.name], shape.points) - start for shape in link.shapes]
        return max([far(link), *(float(np.linalg.norm(part, axis=1).max()) for part in parts)])

    farthest = max(map(far, ends))
    shaped = [link for link in ends if link.shapes and reach(link) >= AT_FOOT * farthest] or ends
    return max(shaped, key=far).name


def chain_to(tree: RobotTree, link: str) -> tuple[TreeJoint, ...]:
    """All joints from the root to a link, in order."""
    by_child = {joint.child: joint for joint in tree.joints}
    found: list[TreeJoint] = []
    while link in by_child:
        found.insert(0, by_child[link])
        link = by_child[link].parent
    return tuple(found)


def sole_under(tree: RobotTree, foot: str, Ts_root_link: Mapping[str, Array]) -> Sole:
    """The sole of a foot link.

    The foot link's own shapes decide where it has some, otherwise all of its rigid body's.

    Args:
        tree: links and joints of the robot.
        foot: name of the foot link.
        Ts_root_link: link → its pose, (4, 4), as the robot stands: z of the root is up.

    Returns:
        What of the foot touches the ground.
    """
    body = tree.bodies()[foot]
    T_foot_root = inverse(Ts_root_link[foot])
    own = tree.link(foot)
    links = (own,) if own.shapes else tree.members(body)
    Ts_foot_link = {link.name: T_foot_root @ Ts_root_link[link.name] for link in links}
    return sole_of(links, Ts_foot_link, -T_foot_root[:3, 2])


def _carried_by_base(tree: RobotTree, joint: TreeJoint) -> bool:
    return tree.bodies()[joint.parent] == tree.root


def _limb(tree: RobotTree, first: TreeJoint, Ts_root_link: dict[str, Array]) -> _Limb:
    """The limb that begins with a joint; where it forks it is followed along its longest way."""
    joints, forks = [first], False
    while True:
        members = {link.name for link in tree.members(joints[-1].child)}
        onward = [joint for joint in tree.joints if joint.moves and joint.parent in members]
        if not onward:
            break
        forks = forks or len(onward) > 1
        joints.append(max(onward, key=lambda joint: _length(tree, joint)))
    lowest = _lowest(tree, joints[-1].child, Ts_root_link)
    return _Limb(tuple(joints), forks, lowest, float(Ts_root_link[first.child][2, 3]))


def _lowest_of_drawn(tree: RobotTree, limbs: Sequence[_Limb]) -> list[dict[str, Array]]:
    """Of each limb link → pose, (4, 4), in the drawn posture in which its last body lies lowest."""
    rng = np.random.default_rng(SEED)
    drawn = [tree.poses(sampled(tree, rng)) for _ in range(DRAWN)]
    return [min(drawn, key=lambda Ts, end=limb.joints[-1].child: _lowest(tree, end, Ts)) for limb in limbs]


def _length(tree: RobotTree, joint: TreeJoint) -> int:
    members = {link.name for link in tree.members(joint.child)}
    return 1 + max((_length(tree, one) for one in tree.joints if one.moves and one.parent in members), default=0)


def _lowest(tree: RobotTree, body: str, Ts_root_link: dict[str, Array]) -> float:
    """Height of a rigid body's lowest point above the root's frame [m]; of its frames where it has no shape."""
    heights = [Ts_root_link[link.name][2, 3] for link in tree.members(body)]
    for link in tree.members(body):
        T_root_link = Ts_root_link[link.name]
        heights += [float((shape.points @ T_root_link[2, :3]).min() + T_root_link[2, 3]) for shape in link.shapes]
    return float(min(heights))


def _why_not(limb: _Limb) -> str:
    free = sum(not joint.mimic for joint in limb.joints)
    if limb.forks:
        return "it forks, as hands do"
    if free < 2:
        return f"{free} joint that moves can't place a foot; at least 2 are needed"
    return ""


def _leg(tree: RobotTree, limb: _Limb, Ts_root_link: dict[str, Array], doubt: str) -> LegChain:
    foot = foot_of(tree, limb.joints[-1])
    joints = tuple(joint.name for joint in limb.joints)
    return LegChain(foot, joints, foot, sole_under(tree, foot, Ts_root_link), 0, doubt)


def _named(legs: list[LegChain]) -> list[LegChain]:
    """Legs called by what their foot links don't share: LF_FOOT, RF_FOOT and so on are LF, RF and so on.

    Where that is another number than the leg's own (wheel_1 of leg 0), names are those of the foot links.
    """
    feet = [leg.foot for leg in legs]
    begin, end = _shared(feet), _shared([foot[::-1] for foot in feet])
    short = [foot[begin : len(foot) - end].strip("_-. ") for foot in feet]
    misleading = any(name.isdecimal() and name != str(leg) for leg, name in enumerate(short))
    names = short if all(short) and len(set(short)) == len(short) and not misleading else feet
    return [
        LegChain(name, leg.joints, leg.foot, leg.sole, leg.group, leg.doubt)
        for name, leg in zip(names, legs, strict=True)
    ]


def _shared(names: list[str]) -> int:
    """How many signs all names begin with alike."""
    return next((i for i, signs in enumerate(zip(*names, strict=False)) if len(set(signs)) > 1), 0)
