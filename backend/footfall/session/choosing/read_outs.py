"""What is told at a place while something is being moved there, before it is chosen: in words, with the reasons."""

import math
from typing import TYPE_CHECKING

import numpy as np

from footfall.core.frames import apply
from footfall.planning.body.body_shift import BodyShift, ShiftRefused
from footfall.planning.step.problem import Point
from footfall.session.answers.choices import FootfallAnswer, ReadOutAnswer
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

if TYPE_CHECKING:
    from footfall.robot.model import Robot

Hip = tuple[float, float]
"""How far a place is from the leg's hip, and how long the leg is [m]."""


def read_footfall(answer: FootfallAnswer, lines: tuple[str, ...], away: float, hip: Hip | None) -> ReadOutAnswer:
    """Of a footfall. answer: of judge_footfall; lines: of every layer; away: from where it was [m]."""
    known = [one for one in (answer["x"], answer["y"], answer["z"]) if one is not None]
    place = ", ".join(f"{one:z.3f}" for one in known)
    brief = answer["footing"] or ("not judged" if answer["known"] else "unknown ground")
    if answer["margin"] is not None:
        brief += f", margin {answer['margin']:z.3f} m"
    text = f"leg {answer['leg']} at ({place}) m: {brief}"
    if answer["slope"] is not None:
        text += f", slope {math.degrees(answer['slope']):z.1f}°"
    reasons = list(answer["reasons"])
    if hip is not None and hip[0] > hip[1]:
        reasons.append(f"it is {hip[0]:z.2f} m from the hip, and the leg is {hip[1]:z.2f} m long")
    return _read(answer["acceptable"], brief, text + _far(away, hip), reasons, lines)


def read_point(dem: Dem, wheel_radius: float, index: int, point: Point, away: float, hip: Hip | None) -> ReadOutAnswer:
    """Of a point that the wheel's centre is to pass."""
    from footfall.terrain.ground.surface import height_at

    x, y, z = point
    ground = float(height_at(dem, x, y))
    brief, reasons = "over unknown ground", []
    if math.isfinite(ground):
        over = z - wheel_radius - ground
        brief = f"the wheel {abs(over):z.3f} m {'over' if over >= 0 else 'in'} the ground"
        if over < 0:
            reasons.append(f"the wheel would be {-over:z.3f} m in the ground")
    else:
        reasons.append("the ground under it is not known")
    if hip is not None and hip[0] > hip[1]:
        reasons.append(f"it is {hip[0]:z.2f} m from the hip, and the leg is {hip[1]:z.2f} m long")
    good = None if not math.isfinite(ground) and len(reasons) == 1 else not reasons
    text = f"point {index + 1} at ({x:z.3f}, {y:z.3f}, {z:z.3f}) m: {brief}"
    return _read(good, brief, text + _far(away, hip), reasons, ())


def read_chassis(shift: BodyShift, found: RobotState | ShiftRefused) -> ReadOutAnswer:
    """Of a shift of the chassis over its standing feet, and where it leads."""
    named = zip(("east", "north", "up"), shift.vector[:3], strict=True)
    turned = zip(("roll", "pitch", "yaw"), np.degrees(shift.vector[3:]), strict=True)
    moves = [f"{name} {amount:+z.3f} m" for name, amount in named if abs(amount) > 5e-4]
    moves += [f"{name} {amount:+z.1f}°" for name, amount in turned if abs(amount) > 0.05]
    text = f"chassis {', '.join(moves) or 'as it stands'}"
    if isinstance(found, ShiftRefused):
        return _read(False, found.reason.partition(";")[0], text, [found.reason], ())
    brief = "the feet can stay"
    return _read(True, brief, f"{text}; {brief}, largest wheel force {found.wheel_forces[:, 2].max():z.0f} N", [], ())


def from_hip(robot: "Robot", state: RobotState, leg: int, point: Point) -> Hip:
    """Of a point, site frame [m]."""
    hip = apply(state.T_site_base, robot.description.legs[leg].T_base_hip[:3, 3])
    return float(np.linalg.norm(np.subtract(point, hip))), float(robot.leg_length(leg))


def _far(away: float, hip: Hip | None) -> str:
    moved = f"; {away:z.3f} m from where it was" if away > 0 else ""
    return moved + ("" if hip is None else f"; {hip[0]:z.2f} m from the hip")


def _read(good: bool | None, brief: str, text: str, reasons: list[str], lines: tuple[str, ...]) -> ReadOutAnswer:
    return {"good": good, "brief": brief, "text": text, "reasons": reasons, "lines": list(lines)}


UNREAD = _read(None, "", "", [], ())
"""Of what was just taken up, before anything is told of its place."""
