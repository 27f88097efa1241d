"""The recheck of a move of the chassis, by other means than the ones it was made with.

Every joint moves in straight lines between waypoints and the chassis on :func:`.base_path`; the path is sampled so
densely that no joint changes by more than ``SAMPLING`` between samples. Wheels are followed by forward kinematics of
their own (no inverse kinematics). Torque is a linear program, so it is solved at least every ``TORQUE_SAMPLING``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from footfall.balance.moving_leg import centers_of_mass
from footfall.balance.support import margins
from footfall.balance.torques import torque_margin
from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.maps.standing import Contacts
from footfall.planning.answers import Check
from footfall.planning.between_rows import base_path
from footfall.planning.body.checked import MoveCheck
from footfall.planning.body.follow import DRIFT, reaches_back
from footfall.planning.body.move import BodyMoveSettings
from footfall.planning.body.reserve import reserves
from footfall.planning.joint_path import samples
from footfall.planning.scene.ground import Nearby
from footfall.planning.scene.lift import LARGEST_STEP
from footfall.planning.scene.whole_body import NearestGap, WholeBody
from footfall.planning.step.verify import TORQUE_SAMPLING
from footfall.robot.description import link_name
from footfall.robot.kinematics import center_of_mass
from footfall.robot.limits import room_to_limits
from footfall.robot.model import Robot

SAMPLING = 0.01
"""Largest change of a joint between two samples [rad]: the chassis moves by a centimetre or so."""
LOCKED = ("wheel", "ankle_roll")
"""Parts of a standing leg that stay where they are: how they meet the ground is no matter of this motion."""


@dataclass(frozen=True)
class Path:
    """Dense samples of a move: postures (m, legs × 6), chassis poses (m, 4, 4), part (m,) of the way 0…1."""

    postures: Array
    Ts_site_base: Array
    part: Array

    def where(self, at: int) -> str:
        """How far on the way sample ``at`` is, for a person."""
        return f"{self.part[at]:.0%} of the way"


def dense(waypoints: Array, Ts_site_base: Array) -> Path:
    """The path between the waypoints (n, legs × 6); each waypoint is itself a sample."""
    postures, poses, part = [waypoints[:1]], [Ts_site_base[:1]], [np.zeros(1)]
    moves = len(waypoints) - 1
    for i in range(moves):
        inner = list(samples(waypoints[i], waypoints[i + 1], SAMPLING))[1:]
        fractions = np.array([t for t, _ in inner])
        postures.append(np.array([q for _, q in inner]))
        poses.append(base_path(Ts_site_base[i], Ts_site_base[i + 1], fractions))
        part.append((i + fractions) / moves)
    return Path(np.concatenate(postures), np.concatenate(poses), np.concatenate(part))


def recheck(
    robot: Robot,
    waypoints: Array,
    Ts_site_base: Array,
    standing: Sequence[int],
    feet: Contacts,
    body: WholeBody,
    settings: BodyMoveSettings,
    pulse: Callable[[], None] = lambda: None,
) -> list[MoveCheck]:
    """Every check of a move of the chassis; it is good if all hold.

    Args:
        robot: the rover.
        waypoints: (n, legs × 6) [rad].
        Ts_site_base: poses of the chassis, (n, 4, 4).
        standing: numbers of the legs that stand.
        feet: their contacts.
        body: chassis and links over the ground.
        settings: what is asked for.
        pulse: called again and again meanwhile.

    Returns:
        The checks.
    """
    path = dense(waypoints, Ts_site_base)
    Ts_base_link = body.poses(path.postures)
    return [
        _limits(robot, path),
        *reserves(robot, waypoints[0], waypoints[-1], standing, settings),
        _continuity(robot, waypoints),
        _drift(robot, path, Ts_base_link, body, standing, feet),
        _own(body, path, Ts_base_link, pulse),
        _ground(body, path, Ts_base_link, standing, pulse),
        _balance(robot, path, feet, settings),
        _torque(robot, path, standing, feet, settings, pulse),
        _unknown(path, feet, body.ground),
    ]


def coms_of(robot: Robot, posture: Array, postures: Array) -> Array:
    """Centres of mass of whole postures.

    A leg's share does not depend on the other legs, so the changes that each makes to that of ``posture`` add up.

    Args:
        robot: the rover.
        posture: any one, (legs × 6,) [rad].
        postures: (n, legs × 6) [rad].

    Returns:
        (n, 3) in base [m]; rows with NaN give NaN.
    """
    own = center_of_mass(robot, posture)
    changes = [centers_of_mass(robot, posture, i, postures[:, 6 * i : 6 * i + 6]) - own for i in robot.legs]
    return own + np.sum(changes, axis=0)


def _scored(name: str, spare: Array, unit: str, where: Callable[[int], str]) -> MoveCheck:
    at = int(np.argmin(spare))
    least = float(spare[at])
    # what nothing holds lacks no size that could be told
    check = Check(name, least >= 0, least if np.isfinite(least) else np.nan, unit, where(at))
    return MoveCheck(check, bool(spare[0] < 0), bool(spare[-1] < 0))


def _limits(robot: Robot, path: Path) -> MoveCheck:
    spare = room_to_limits(robot, path.postures)
    joint = np.argmin(spare, axis=1)
    return _scored(
        "joint limits", spare.min(axis=1), "rad", lambda at: f"{robot.joint_names[joint[at]]}, {path.where(at)}"
    )


def _continuity(robot: Robot, waypoints: Array) -> MoveCheck:
    """No jumps, and no leg turns its knee over or reaches over its hip."""
    name = "branch continuity"
    for leg in robot.legs:
        q = waypoints[:, 6 * leg : 6 * leg + 6]
        turned = (q[:, 2] >= 0) != (q[0, 2] >= 0)
        turned |= np.array([reaches_back(robot, leg, one) for one in q]) != reaches_back(robot, leg, q[0])
        if turned.any():
            where = f"leg {leg} changes its branch at waypoint {int(np.argmax(turned))}"
            return MoveCheck(Check(name, False, float("nan"), "", where))
    change = np.abs(np.diff(waypoints, axis=0))
    step, joint = np.unravel_index(int(np.argmax(change)), change.shape)
    spare = LARGEST_STEP - float(change[step, joint])
    return MoveCheck(Check(name, spare >= 0, spare, "rad", f"{robot.joint_names[joint]}, to waypoint {step + 1}"))


def _drift(
    robot: Robot, path: Path, Ts_base_link: Array, body: WholeBody, standing: Sequence[int], feet: Contacts
) -> MoveCheck:
    """How far the contact point and the axle's ends, thought fixed to the wheel, move in site."""
    moved = np.zeros((len(path.part), len(standing)))
    half = 0.5 * robot.description.wheel_width
    for i, leg in enumerate(standing):
        Ts = path.Ts_site_base @ Ts_base_link[:, body.links.index(link_name(leg, "wheel"))]
        contact = apply(inverse(Ts[0]), feet.points[i])
        points = np.array([contact, (0.0, half, 0.0), (0.0, -half, 0.0)])
        away = np.einsum("nij,vj->nvi", Ts[:, :3, :3] - Ts[0, :3, :3], points) + (Ts - Ts[0])[:, None, :3, 3]
        moved[:, i] = np.linalg.norm(away, axis=2).max(axis=1)
    leg = np.argmax(moved, axis=1)
    return _scored(
        "contact drift", DRIFT - moved.max(axis=1), "m", lambda at: f"leg {standing[leg[at]]}, {path.where(at)}"
    )


def _own(body: WholeBody, path: Path, Ts_base_link: Array, pulse: Callable[[], None]) -> MoveCheck:
    pulse()
    found = body.own_gap(Ts_base_link)
    return _near("self collision", found, path, lambda at: body.own_gap(Ts_base_link[at]))


def _ground(
    body: WholeBody,
    path: Path,
    Ts_base_link: Array,
    standing: Sequence[int],
    pulse: Callable[[], None],
) -> MoveCheck:
    pulse()
    locked = {link_name(leg, part) for leg in standing for part in LOCKED}
    links = [link for link in body.links if link not in locked]
    Ts = path.Ts_site_base[:, None] @ Ts_base_link
    found = body.ground_gap(Ts, links)
    return _near("terrain collision", found, path, lambda at: body.ground_gap(Ts[at], links))


def _near(name: str, found: NearestGap, path: Path, again: Callable[[slice], NearestGap]) -> MoveCheck:
    spare = found.gap.spare
    check = Check(name, spare >= 0, spare, "m", f"{found.gap.between}, beyond δ, {path.where(found.at)}")
    if spare >= 0:
        return MoveCheck(check)
    return MoveCheck(check, again(slice(0, 1)).gap.spare < 0, again(slice(-1, None)).gap.spare < 0)


def _balance(robot: Robot, path: Path, feet: Contacts, settings: BodyMoveSettings) -> MoveCheck:
    coms = coms_of(robot, path.postures[0], path.postures)
    coms_xy = np.einsum("nij,nj->ni", path.Ts_site_base[:, :2, :3], coms) + path.Ts_site_base[:, :2, 3]
    spare = margins(feet.points, coms_xy, settings.conservative) - settings.least_margin
    name = "balance (conservative polygon)" if settings.conservative else "balance (support polygon)"
    return _scored(name, spare, "m", path.where)


def _torque(
    robot: Robot,
    path: Path,
    standing: Sequence[int],
    feet: Contacts,
    settings: BodyMoveSettings,
    pulse: Callable[[], None],
) -> MoveCheck:
    rows, last = [0], path.postures[0]
    for i, q in enumerate(path.postures[1:], start=1):
        if i == len(path.part) - 1 or np.abs(q - last).max() > TORQUE_SAMPLING - SAMPLING:
            rows.append(i)
            last = q
    ratios, joints = [], []
    for i in rows:
        pulse()
        held = torque_margin(
            robot, path.postures[i], path.Ts_site_base[i], list(standing), feet.normals, settings.friction
        )
        ratios.append(held.ratio)
        joints.append(held.joint_name if held.feasible else "no contact forces inside friction hold the rover")
    unseen = ", ".join(str(leg) for leg, seen in zip(standing, feet.seen, strict=True) if not seen)
    note = f"; ground taken as level under legs {unseen}, where it is unknown" if unseen else ""
    spare = 1.0 - np.array(ratios)
    return _scored("torque", spare, "of the limit", lambda at: f"{joints[at]}, {path.where(rows[at])}{note}")


def _unknown(path: Path, feet: Contacts, ground: Nearby) -> MoveCheck:
    """How much of the ground between the feet was not seen; never a reason to refuse, but to be told."""
    middle = path.Ts_site_base[:, :2, 3].mean(axis=0)
    radius = float(np.linalg.norm(feet.points[:, :2] - middle, axis=1).max())
    away = np.linalg.norm(ground.dem.geometry.centers() - middle, axis=2)
    count = int((ground.filled & (away <= radius)).sum())
    text = f"{count} cells, taken as high as their highest known neighbour" if count else "none"
    return MoveCheck(Check("unknown ground between the feet", True, float("nan"), "", text))
