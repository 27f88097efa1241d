"""Why a leg can or can't stand on a cell: the classes, their names and texts, in one table."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from footfall.robot.description import JOINTS, PARTS
from footfall.robot.proof.obstacles import CHASSIS, LEG, PAYLOAD, SELF, TERRAIN

(
    UNKNOWN,
    OUT_OF_RANGE,
    NO_GEOMETRY,
    JOINT_LIMIT,
    FOOT_COLLISION,
    NO_LIFT,
    WAYPOINT_COLLISION,
    UNSURE,
    FREE,
    NOT_LIFTED,
) = range(10)

CLASSES: Mapping[int, tuple[str, str]] = {
    UNKNOWN: ("unknown", "too little of the ground within a wheel's radius is known"),
    OUT_OF_RANGE: ("out of reach", "farther from the hip than the stretched leg"),
    NO_GEOMETRY: ("no solution", "thigh and shank can't bring the wheel there upright on the ground"),
    JOINT_LIMIT: ("joint limit", "every posture that gets there turns a joint past its limit"),
    FOOT_COLLISION: ("collision", "every posture tried there, the wheel upright, collides"),
    NO_LIFT: ("no way up", "the wheel can't be raised from there, as it is tilted, inside the joint limits"),
    WAYPOINT_COLLISION: ("collision above", "the leg collides where it would start to lower the upright wheel"),
    UNSURE: ("unsure", "joint angles exist; whether the leg collides has not been found out"),
    FREE: ("free", "inside the limits and free of collision, there and above"),
    NOT_LIFTED: ("not lifted", "the leg can't be lifted from where it stands, wherever it would step"),
}
"""Class → name and meaning. Only FREE says yes; UNSURE says neither."""

OBSTACLES: Mapping[int, str] = {
    CHASSIS: "the chassis",
    PAYLOAD: "the payload",
    SELF: "its own leg",
    TERRAIN: "the ground",
}
"""What a leg collides with; LEG + i is leg i."""


NO_HINDRANCE, HINDERED_JOINT, HINDERED_BY, NOT_PLACED, BEYOND, UNSEEN = 0, 1, 8, 253, 254, 255
"""Codes of the layer "hindrance": none, the first joint, what is hit; no geometry, out of reach, unknown."""


def hindrances(reason: NDArray[np.uint8], blame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """What stops the leg at cells of the given class and blame, as codes of the layer "hindrance", any shape."""
    out = np.full(reason.shape, NO_HINDRANCE, np.uint8)
    for one, code in ((NO_GEOMETRY, NOT_PLACED), (OUT_OF_RANGE, BEYOND), (UNKNOWN, UNSEEN)):
        out[reason == one] = code
    joint = reason == JOINT_LIMIT
    out[joint] = HINDERED_JOINT + blame[joint]
    hit = (reason == FOOT_COLLISION) | (reason == WAYPOINT_COLLISION)
    out[hit] = HINDERED_BY + blame[hit]
    return out


def hindrance_text(code: int) -> str:
    """What a code of the layer "hindrance" means."""
    if HINDERED_JOINT <= code < HINDERED_JOINT + len(JOINTS):
        return f"{_spoken(JOINTS[code - HINDERED_JOINT][0])} at its limit"
    if HINDERED_BY <= code < NOT_PLACED:
        return f"hits {_obstacle(code - HINDERED_BY)}"
    return {NO_HINDRANCE: "nothing", NOT_PLACED: "no solution", BEYOND: "out of reach", UNSEEN: "unknown ground"}[code]


def _obstacle(blame: int) -> str:
    return f"leg {blame - LEG}" if blame >= LEG else OBSTACLES[blame]


def explained(reason: int, blame: int, link: int, seat: float, sink: float, lift: float) -> str:
    """One cell's answer for a person.

    Args:
        reason: class of the cell.
        blame: the joint of JOINT_LIMIT, what is hit in a collision.
        link: index into PARTS of what hits.
        seat: height of the wheel over the fitted ground [m].
        sink: how much of that a wheel may sink in [m].
        lift: how far above the footfall the leg has to be free [m].

    Returns:
        One sentence.
    """
    text = CLASSES[reason][1]
    if reason == JOINT_LIMIT:
        text = f"no posture keeps the joint limits; nearest to it, {_spoken(JOINTS[blame][0])} turns too far"
    elif reason in (FOOT_COLLISION, WAYPOINT_COLLISION):
        obstacle = _obstacle(blame)
        where = "there" if reason == FOOT_COLLISION else f"{100 * lift:z.0f} cm above"
        text = f"with the wheel upright the {_spoken(PARTS[link])} collides with {obstacle} {where}"
    if seat > sink:
        text += f"; the wheel stands {100 * seat:z.0f} cm above the fitted ground on a bump"
    return text


def _spoken(name: str) -> str:
    return name.replace("_", " ")
