"""Legs that are built alike: same kinds of joints in the same order, same kind of foot, nearly the same lengths."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.robot.legged.legged_model import LegChain, LeggedModel
from footfall.robot.legged.tree import RobotTree

ALIKE = 0.1
"""Legs are of one group where the lengths of their parts differ by at most this share of the leg."""


def grouped(tree: RobotTree, legs: Sequence[LegChain]) -> tuple[LegChain, ...]:
    """The same legs, each with the number of its group, from 0 on."""
    first: list[LegChain] = []
    numbered = []
    for leg in legs:
        group = next((i for i, other in enumerate(first) if _alike(tree, leg, other)), len(first))
        if group == len(first):
            first.append(leg)
        numbered.append(LegChain(leg.name, leg.joints, leg.foot, leg.sole, group, leg.doubt))
    return tuple(numbered)


def part_lengths(tree: RobotTree, leg: LegChain) -> NDArray[np.float64]:
    """Distances between a leg's successive joints, and from the last to the foot's centre, (joints,) [m]."""
    Ts_root_link = tree.poses({})
    places = [Ts_root_link[tree.joint(name).child][:3, 3] for name in leg.joints]
    T_root_foot = Ts_root_link[leg.foot]
    places.append(T_root_foot[:3, :3] @ leg.sole.center + T_root_foot[:3, 3])
    return np.linalg.norm(np.diff(places, axis=0), axis=1)


def longest_leg(model: LeggedModel) -> float:
    """The sum of those of the longest leg [m]."""
    return max(float(part_lengths(model.tree, leg).sum()) for leg in model.legs)


def leg_mass(tree: RobotTree, leg: LegChain) -> float:
    """Of all bodies that a leg's joints carry [kg]."""
    return float(sum(link.mass for name in leg.joints for link in tree.members(tree.joint(name).child)))


def _alike(tree: RobotTree, a: LegChain, b: LegChain) -> bool:
    kinds_a, kinds_b = ([tree.joint(name).kind for name in leg.joints] for leg in (a, b))
    if kinds_a != kinds_b or a.sole.kind != b.sole.kind:
        return False
    lengths_a, lengths_b = part_lengths(tree, a), part_lengths(tree, b)
    return bool(np.abs(lengths_a - lengths_b).max() <= ALIKE * max(lengths_a.sum(), lengths_b.sum()))
