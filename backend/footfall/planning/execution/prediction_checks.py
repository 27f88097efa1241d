"""What must hold of a predicted motion, and by how much it does."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from footfall.balance.payload import loaded
from footfall.balance.support import margins
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.planning.answers import Check, Status
from footfall.planning.body.move_checks import LOCKED, Path, coms_of, dense
from footfall.planning.compliance.ball_contact import second_gaps
from footfall.planning.compliance.compliant_rover import RestingRover
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.execution.problem import BodyExecution, Execution, Predicted, ends_of
from footfall.planning.scene.whole_body import NearestGap, WholeBody
from footfall.robot.description import link_name
from footfall.robot.limits import room_to_limits
from footfall.robot.model import Robot
from footfall.robot.tolerance import inside
from footfall.terrain.dem import Dem

ADVICE = {
    "wheel clearance": "ask for a higher lift, or take another mode",
    "joint limits of the set points": "move the chassis, or choose a footfall nearer to the leg",
    "joint limits": "move the chassis, or choose a footfall nearer to the leg",
    "self collision": "choose another footfall or move the chassis",
    "terrain collision": "ask for a higher lift, take another mode, or move the chassis",
    "torque": "move the chassis away from the leg, or carry less",
    "friction": "move the chassis, or take the mode pose_held",
    "load on the supporting wheels": "move the chassis away from the leg",
    "wheels on one side of the ground": "take the mode pose_held, or move that leg first",
    "balance": "move the chassis away from the leg",
    "pose of the chassis": "move the chassis less far at a time",
    "touch-down": "ask for more overshoot; the ground may be lower than the map says",
    "touch-down offset": "take the mode droop_aware or pose_held",
}
"""What to try where a check fails, by its name."""

ASTRAY = 0.01
"""So far a chassis whose pose is held may be predicted from where it is to be [m]."""
WORSE = 1.05
"""What the start of a move lacks already may become so many times as much on the way."""
LEAN = 0.003
"""A wheel nearer than this to the ground on another side leans against it [m]: hubs are predicted so well."""


def checks_of(
    robot: Robot, done: Execution, rests: Sequence[RestingRover], body: WholeBody, settings: ExecutionSettings
) -> tuple[Check, ...]:
    """Every check of an execution; rests: where the rover is predicted to be, n of them."""
    where = _where(done)
    supports = [leg for leg in robot.legs if leg != done.leg]
    path = dense(done.predicted, done.Ts_site_base)
    contacts = np.array([one.contacts for one in rests])
    return (
        _clearance(done, settings, where),
        _limits("joint limits of the set points", robot, _set_points(done), where),
        _limits("joint limits", robot, inside(robot, done.predicted), where),
        _own(body, done, path),
        _ground(body, done, path, supports),
        *_borne(robot, done, rests, supports, settings),
        *([] if done.mode == "pose_held" else [_one_contact(robot, done, rests, body.ground.dem, supports, where)]),
        _balance(robot, done, contacts[:, supports], settings),
        _touch_down(done, settings),
        _offset(done, settings),
    )


def body_checks_of(
    robot: Robot, done: BodyExecution, rests: Sequence[RestingRover], body: WholeBody, settings: ExecutionSettings
) -> tuple[Check, ...]:
    """Every check of a move of the chassis; rests: where the rover is predicted to be, n of them.

    A joint, or a wheel, that bears more than it may where the move begins, as it was measured there, must not bear yet
    more on the way, and no more than it may in the end: a rover that stands so is to be led out of it.
    """
    where = _where(done)
    supports = [int(leg) for leg in np.flatnonzero(rests[0].touching)]
    standing = {link_name(leg, part) for leg in supports for part in LOCKED}
    path = dense(done.predicted, done.Ts_site_base)
    Ts_site_link = path.Ts_site_base[:, None] @ body.poses(path.postures)
    nearest = body.ground_gap(Ts_site_link, [link for link in body.links if link not in standing])
    contacts = np.array([one.contacts for one in rests])
    return (
        _limits("joint limits of the set points", robot, done.commanded, where),
        _limits("joint limits", robot, inside(robot, done.predicted), where),
        _own(body, done, path),
        _near("terrain collision", nearest, np.arange(len(path.part)), done, path),
        *_borne(robot, done, rests, supports, settings, led_back=True),
        _balance(robot, done, contacts[:, supports], settings),
        _pose(done),
    )


def _where(done: Predicted) -> Callable[[int], str]:
    return lambda at: f"waypoint {at} ({done.phases[at]})"


def _pose(done: BodyExecution) -> Check:
    away = np.linalg.norm(done.Ts_site_base[:, :3, 3] - done.wanted[:, :3, 3], axis=1)
    return _worst("pose of the chassis", ASTRAY - away[:, None], "m", lambda at, _: _where(done)(at))


def _borne(
    robot: Robot,
    done: Predicted,
    rests: Sequence[RestingRover],
    supports: list[int],
    settings: ExecutionSettings,
    led_back: bool = False,
) -> tuple[Check, ...]:
    """What joints and supporting wheels bear. led_back: what the first row lacks may be lacking until the last."""
    where = _where(done)
    ratios = np.abs([one.torques for one in rests]) / robot.torque_limits

    def check(name: str, spare: Array, unit: str, bearer: Callable[[int], str]) -> Check:
        lacking = np.minimum(spare[0], 0.0) if led_back else np.zeros(spare.shape[1])
        allowed = np.outer(np.arange(len(spare)) < len(spare) - 1, WORSE * lacking)

        def borne_by(at: int, column: int) -> str:
            began = f"; it lacked {-lacking[column]:z.3g} {unit} where it began" if lacking[column] < 0 else ""
            return f"{bearer(column)}, {where(at)}{began}"

        return _worst(name, spare - allowed, unit, borne_by)

    return (
        check("torque", 1.0 - ratios, "of the limit", lambda joint: robot.joint_names[joint]),
        check(
            "friction",
            1.0 - settings.spare_friction - done.friction_use[:, supports],
            "of the cone",
            lambda i: f"leg {supports[i]}",
        ),
        check(
            "load on the supporting wheels",
            done.loads[:, supports] - settings.least_load,
            "N",
            lambda i: f"leg {supports[i]}",
        ),
    )


def _worst(name: str, spare: Array, unit: str, where: Callable[[int, int], str]) -> Check:
    at, column = np.unravel_index(int(np.argmin(spare)), spare.shape)
    least = float(spare[at, column])
    return Check(name, least >= 0, least, unit, where(int(at), int(column)))


def _clearance(done: Execution, settings: ExecutionSettings, where: Callable[[int], str]) -> Check:
    at = int(done.aloft[np.argmin(done.clearance[done.aloft])])
    spare = float(done.clearance[at]) - settings.least_clearance
    doubt = done.clearance_uncertainty[at]
    how = f"{abs(doubt):z.3f} m {'less' if doubt >= 0 else 'more'} with springs {settings.tolerance:.0%} softer"
    how = how if np.isfinite(doubt) else f"with springs {settings.tolerance:.0%} softer it does not stand"
    return Check("wheel clearance", spare >= 0, spare, "m", f"{where(at)}; {how}")


def _set_points(done: Execution) -> Array:
    """(n, legs × 6) commanded; where lowering stops, as low as it may go."""
    out = done.commanded.copy()
    out[done.stopped_at, 6 * done.leg : 6 * done.leg + 6] = done.lowest
    return out


def _limits(name: str, robot: Robot, postures: Array, where: Callable[[int], str]) -> Check:
    spare = room_to_limits(robot, postures)
    return _worst(name, spare, "rad", lambda at, joint: f"{robot.joint_names[joint]}, {where(at)}")


def _own(body: WholeBody, done: Predicted, path: Path) -> Check:
    return _near("self collision", body.own_gap(body.poses(path.postures)), np.arange(len(path.part)), done, path)


def _ground(body: WholeBody, done: Execution, path: Path, supports: list[int]) -> Check:
    """Chassis and legs, at the poses that they sag to. How standing wheels are pressed in is no collision.

    The swing leg's wheel keeps its distance in the swing, may touch while it lifts and lowers, and is pressed in else.
    """
    ends = np.ceil(path.part * (len(done.phases) - 1) - 1e-9).astype(int)
    starts = np.maximum(ends - 1, 0)
    phases = np.array(done.phases)[ends]
    swings = phases == "swing"
    above = np.minimum(done.clearance[ends], done.clearance[starts]) > 0
    touching = ~swings & above & np.isin(phases, ("lift", "lower"))
    standing = {link_name(leg, part) for leg in supports for part in LOCKED}
    pressed = standing | {link_name(done.leg, part) for part in LOCKED}
    Ts_site_link = path.Ts_site_base[:, None] @ body.poses(path.postures)
    found = []
    for chosen, left_out, legs in (
        (swings, standing, ()),
        (touching, standing, (done.leg,)),
        (~swings & ~touching, pressed, ()),
    ):
        rows = np.flatnonzero(chosen)
        if len(rows):
            links = [link for link in body.links if link not in left_out]
            nearest = body.ground_gap(Ts_site_link[rows], links, touching=legs)
            found.append(_near("terrain collision", nearest, rows, done, path))
    return min(found, key=lambda check: check.margin)


def _near(name: str, found: NearestGap, rows: NDArray[np.int64], done: Predicted, path: Path) -> Check:
    at = int(np.ceil(path.part[rows[found.at]] * (len(done.phases) - 1) - 1e-9))
    spare = found.gap.spare
    return Check(name, spare >= 0, spare, "m", f"{found.gap.between}, beyond δ, waypoint {at} ({done.phases[at]})")


def _one_contact(
    robot: Robot,
    done: Execution,
    rests: Sequence[RestingRover],
    dem: Dem,
    supports: list[int],
    where: Callable[[int], str],
) -> Check:
    """Whether each supporting wheel touches the ground on one side only, at the ends of the phases.

    One that leans against a rock's flank too yields otherwise than on the one plane that the prediction knows.
    """
    rows = ends_of(done.phases)
    rims, contacts = (np.array([getattr(rests[at], of)[supports] for at in rows]) for of in ("rims", "contacts"))
    gaps = second_gaps(dem, rims.reshape(-1, 3), contacts.reshape(-1, 3), robot.wheel_radius).reshape(len(rows), -1)
    return _worst(
        "wheels on one side of the ground",
        gaps - LEAN,
        "m",
        lambda row, i: f"leg {supports[i]} leans against another, {where(rows[row])}",
    )


def _balance(robot: Robot, done: Predicted, feet: Array, settings: ExecutionSettings) -> Check:
    """The centre of mass over the polygon of the wheels (n, k, 3) that support all along, looked at along gravity."""
    R_level_site = settings.compliance.balance.R_level_site
    coms = coms_of(robot, done.predicted[0], done.predicted)
    spare = np.empty(len(coms))
    for i, (T_site_base, com) in enumerate(zip(done.Ts_site_base, coms, strict=True)):
        _, center = loaded(robot, com, settings.compliance.balance)
        com_level = R_level_site @ apply(T_site_base, center)
        spare[i] = margins(feet[i] @ R_level_site.T, com_level[None, :2])[0]
    at = int(np.argmin(spare))
    return Check("balance", bool(spare[at] >= 0), float(spare[at]), "m", _where(done)(at))


def _touch_down(done: Execution, settings: ExecutionSettings) -> Check:
    """Whether the ground is predicted to stop the lowering."""
    name = "touch-down"
    if done.stopped_at < 0:
        risen = max(float(done.forces[-1, done.leg, 2]), 0.0)
        where = f"{settings.overshoot:z.2f} m below the planned contact the wheel carries {risen:z.0f} N"
        return Check(name, False, risen - done.stop_force, "N", where)
    left = done.lowest - done.commanded[done.stopped_at, 6 * done.leg : 6 * done.leg + 6]
    whole = done.lowest - done.commanded[done.guarded_from, 6 * done.leg : 6 * done.leg + 6]
    share = float(np.abs(left).max() / np.abs(whole).max())
    return Check(name, True, share, "of the way down", f"waypoint {done.stopped_at}")


def _offset(done: Execution, settings: ExecutionSettings) -> Check:
    name, offset = "touch-down offset", done.touch_down_offset
    if np.isnan(offset):
        return Check(name, False, float("nan"), "m", "the wheel does not touch the ground")
    return Check(name, offset <= settings.largest_offset, settings.largest_offset - offset, "m", f"{offset:z.3f} m off")


def judged(checks: Iterable[Check]) -> tuple[Status, str]:
    """Whether all checks hold, or the first that fails, by how much, where, and what to try."""
    check = next((one for one in checks if not one.holds), None)
    if check is None:
        return Status.FOUND, ""
    size = f" by {-check.margin:.3g} {check.unit}" if check.margin < 0 else ""
    reason = f"the predicted motion fails the check of {check.name}{size} ({check.where}); {ADVICE[check.name]}"
    return Status.NO_PATH, reason
