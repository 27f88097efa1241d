"""Where commands are predicted to leave a robot that others described, and by how much that may be wrong.

What the prediction does not know is taken as in :mod:`footfall.sequence.foretold`, but for two things: what softer
springs do is told by how much farther the joints give way at rest, and a joint that slides errs by SLIDES.
"""

import numpy as np

from footfall.balance.balance_settings import GRAVITY
from footfall.balance.legged_effort import moves_at, statics_of
from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.value import Provenance
from footfall.planning.compliance.from_telemetry import LEAST_LOAD, UNEXPLAINED
from footfall.planning.compliance.seen_yield import gives_way
from footfall.planning.execution.seen_clearance import NORMAL_95, height_deviation
from footfall.planning.legged.under_feet import ground_under
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.sequence.commands import Sequence
from footfall.sequence.foretold import SPRINGS, UNSTATED_SD, platform, require_rows
from footfall.sequence.legged_passage import landed, legged_passages
from footfall.sequence.outcome import Foretold, Outcome, compare, seen_at_rest
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

SLIDES = 0.001
"""One standard deviation of the place of a joint that slides [m] (assumed)."""
ELSEWHERE = 0.02
"""A foot commanded farther than this from where it stood stands on other ground, as a share of the longest leg."""
STILL = 1e-3
"""Joints that are nearer to their set points than this, in the median, do not give way [rad or m]."""
SOFTEST = 1e-12
"""Beside it no leg is so stiff that its stiffness can't be computed [m/N]."""

ADVICE = {
    "touch-down": "look at how the foot stands before the next step: take images and build the terrain anew",
    "load": "the ground is not as high as the map says, or joints give way otherwise than the robot.toml says: look at "
    "both before a leg beside it is lifted",
    "drift": "look at stiffness and payload in the robot.toml before the next step",
    "sink": "look at stiffness and payload in the robot.toml before the next step",
}
"""What to do where a quantity differs, by its name."""
RIGID = "say in the robot.toml how stiff each joint is: these commands took the robot as rigid"


def legged_outcome(
    robot: LeggedRobot, dem: Dem, sequence: Sequence, state: RobotState, set_points: Array, run: int, rows: int
) -> Outcome:
    """What was predicted of the rows that were run, beside what came of them.

    Args:
        robot: the robot.
        dem: the ground, in site.
        sequence: that was run.
        state: how the robot rests after them, its pose on the map.
        set_points: (joints,) that it has there [rad or m].
        run: number of the run.
        rows: how many rows, from the first on.

    Returns:
        Each quantity, predicted and measured, with a verdict.

    Raises:
        InvalidInput: the sequence has not so many rows.
    """
    require_rows(sequence, rows)
    predicted = legged_foretold(robot, dem, sequence, rows)
    seen = seen_at_rest(state, placed(robot, state.posture).soles)
    parents = {"robot": robot.digest, "dem": dem.digest, "sequence": sequence.digest, "state": state.digest}
    advice = dict.fromkeys(ADVICE, RIGID) if predicted.rigid else ADVICE
    return Outcome(
        run=run,
        rows=rows,
        rigid=predicted.rigid,
        sags=_sags(robot, state, set_points),
        differences=compare(predicted, seen, advice, robot.leg_names),
        provenance=Provenance(parents),
    )


def _sags(robot: LeggedRobot, state: RobotState, set_points: Array) -> bool | None:
    if robot.sags:
        return gives_way(state, set_points, robot.stiffness)
    off = float(np.median(np.abs(set_points - state.posture)))
    return None if np.isnan(off) else off > STILL


def legged_foretold(robot: LeggedRobot, dem: Dem, sequence: Sequence, rows: int) -> Foretold:
    """Where the first rows lead.

    Args:
        robot: the robot.
        dem: the ground, in site.
        sequence: commands of the robot.
        rows: how many, from the first on.

    Returns:
        The place of feet and chassis, the loads of a robot that sags, and how sure each is.
    """
    q, T = sequence.predicted[rows - 1], sequence.poses[rows - 1]
    soles, before = apply(T, placed(robot, q).soles), apply(sequence.T_site_base, placed(robot, sequence.start).soles)
    ground = ground_under(robot, dem, before, robot.legs)
    down = landed(robot, ground, q, T, list(robot.legs))
    standing = [leg for leg, (sole, _, _) in zip(robot.legs, down, strict=True) if np.isfinite(sole).all()]
    lifts = _lifts(robot, q, T)
    errors = [UNEXPLAINED + (SLIDES - UNEXPLAINED) * robot.limbs[leg].limb.slides for leg in robot.legs]
    wrong = [lift * error for lift, error in zip(lifts, errors, strict=True)]
    pose = np.hstack([wrong[leg] for leg in standing]) / max(len(standing), 1) if standing else np.zeros((3, 1))
    drift, sink = float(np.linalg.norm(pose[:2])), float(np.linalg.norm(pose[2]))
    touch = np.array([np.hypot(np.linalg.norm(one[:2]), drift) for one in wrong])
    moved = {command.leg for command in sequence.commands[:rows] if command.leg is not None}
    apart = np.linalg.norm(soles - before, axis=1)
    stepped = tuple(leg for leg in sorted(moved) if apart[leg] > ELSEWHERE * robot.length)
    nothing = np.full(len(robot.legs), np.nan)
    normals = np.array([np.where(np.isfinite(normal).all(), normal, (0.0, 0.0, 1.0)) for _, _, normal in down])
    about = {"start": sequence.T_site_base, "end": T, "stepped": stepped, "hubs": soles, "normals": normals}
    if sequence.at_rest is None or sequence.commanded is None:
        return Foretold(
            rigid=True,
            **about,
            loads=nothing,
            touch_uncertainty=NORMAL_95 * touch,
            load_uncertainty=nothing,
            drift_uncertainty=NORMAL_95 * drift,
            sink_uncertainty=NORMAL_95 * sink,
        )
    ended = legged_passages(
        robot, sequence.start, sequence.T_site_base, sequence.commands[:rows], ground, sequence.at_rest
    )[-1]
    forces = np.zeros_like(normals) if ended.forces is None else ended.forces
    heights = np.zeros(len(robot.legs))
    for leg in stepped:
        told = height_deviation(dem, soles[leg, :2])
        heights[leg] = np.hypot(UNSTATED_SD if told is None else told, np.linalg.norm(wrong[leg][2]))
    yields = {
        leg: lifts[leg] / robot.stiffness[robot.slices[leg]] @ lifts[leg].T + SOFTEST * np.eye(3) for leg in standing
    }
    legs = platform(np.array([contact for _, contact, _ in down]), T[:3, 3], yields)
    given = sequence.commanded[rows - 1] - q
    softer = SPRINGS / (1 - SPRINGS) * np.array([lifts[leg] @ given[robot.slices[leg]] for leg in robot.legs])
    chassis = -softer[standing].mean(axis=0) if standing else np.zeros(3)
    drift, sink = (
        np.hypot(drift, np.linalg.norm(legs.sway * heights)),
        np.hypot(sink, np.linalg.norm(legs.rise * heights)),
    )
    touch = np.array([np.hypot(np.linalg.norm(one[:2]), drift) for one in wrong])
    sensor = LEAST_LOAD * robot.mass * GRAVITY
    return Foretold(
        rigid=False,
        **about,
        loads=(forces * normals).sum(axis=1),
        touch_uncertainty=np.linalg.norm((softer + chassis)[:, :2], axis=1) + NORMAL_95 * touch,
        load_uncertainty=NORMAL_95 * np.hypot(np.linalg.norm(legs.loads * heights, axis=1), sensor),
        drift_uncertainty=float(np.linalg.norm(chassis[:2]) + NORMAL_95 * drift),
        sink_uncertainty=float(abs(chassis[2]) + NORMAL_95 * sink),
    )


def _lifts(robot: LeggedRobot, q: Array, T_site_base: Array) -> list[Array]:
    """How the middle of each sole moves in site with its leg's joints, (3, joints of the leg)."""
    R = T_site_base[:3, :3]
    _, axes, origins, _ = statics_of(robot, q, R)
    soles = placed(robot, q).soles
    return [R @ moves_at(robot, leg, soles[leg], axes, origins).T for leg in robot.legs]
