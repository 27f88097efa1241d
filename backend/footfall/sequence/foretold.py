"""Where commands are predicted to leave a rover, and by how much that may be wrong.

What the prediction does not know, each taken apart:

- springs: all softer by the share SPRINGS, started from the same telemetry; how far that leads elsewhere is a bound.
- joints: each errs by UNEXPLAINED, alone of all others, one standard deviation, as the prediction of sag has it.
- ground: under a wheel that is put elsewhere it is as high as the map says, with the variance of the map's cells
  there, or UNSTATED_SD where it does not say. What stands where it stood has told its height by how it was pressed in.
- forces: sensors err by the share LEAST_LOAD of the weight.

The last three are independent: their squares add, and NORMAL_95 of their deviations holds 95 of 100 cases.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from footfall.core.arrays import Array
from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.core.value import Provenance
from footfall.planning.compliance.compliance_settings import WIDEST, ComplianceSettings
from footfall.planning.compliance.compliant_rover import RestingRover
from footfall.planning.compliance.from_telemetry import LEAST_LOAD, UNEXPLAINED
from footfall.planning.compliance.seen_yield import gives_way
from footfall.planning.execution.seen_clearance import NORMAL_95, height_deviation
from footfall.robot.kinematics import wheel_centers, wheel_jacobian
from footfall.robot.model import Robot
from footfall.sequence.commands import Command, Sequence
from footfall.sequence.moved_legs import moved_legs
from footfall.sequence.outcome import Foretold, Outcome, compare, seen_at_rest
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import follow
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

SPRINGS = 0.2
"""So much softer, as a share, the springs may be than assumed."""
UNSTATED_SD = 0.005
"""One standard deviation of the heights of a map that does not say how sure they are [m]."""
ELSEWHERE = 0.02
"""A wheel whose centre is commanded farther than this from where it stood stands on other ground [m]."""


def outcome(
    robot: Robot, dem: Dem, sequence: Sequence, state: RobotState, set_points: Array, run: int, rows: int
) -> Outcome:
    """What was predicted of the rows that were run, beside what came of them.

    Args:
        robot: the rover.
        dem: the ground, in site.
        sequence: that was run.
        state: how the rover rests after them, its pose on the map.
        set_points: (legs × 6,) that it has there [rad].
        run: number of the run.
        rows: how many rows, from the first on.

    Returns:
        Each quantity, predicted and measured, with a verdict.

    Raises:
        InvalidInput: the sequence has not so many rows, or they are not predicted so far.
    """
    require_rows(sequence, rows)
    predicted = foretold(robot, dem, sequence, rows)
    seen = seen_at_rest(state, wheel_centers(robot, state.posture))
    parents = {"robot": robot.digest, "dem": dem.digest, "sequence": sequence.digest, "state": state.digest}
    return Outcome(
        run=run,
        rows=rows,
        rigid=predicted.rigid,
        sags=gives_way(state, set_points, robot.stiffness),
        differences=compare(predicted, seen),
        provenance=Provenance(parents),
    )


def require_rows(sequence: Sequence, rows: int) -> None:
    """Raises InvalidInput where a sequence has not so many rows, or none is asked for."""
    if not 1 <= rows <= len(sequence.commands):
        raise InvalidInput(f"a run of {len(sequence.commands)} rows has no row {rows} to compare", rows=rows)


def foretold(robot: Robot, dem: Dem, sequence: Sequence, rows: int) -> Foretold:
    """Where the first ``rows`` rows lead. Raises InvalidInput where that is not predicted."""
    end = rows - 1
    posture, T = sequence.predicted[end], sequence.poses[end]
    hubs = apply(T, wheel_centers(robot, posture))
    stepped = _stepped(robot, sequence, hubs, rows)
    lift = np.array([_turned(T, wheel_jacobian(robot, posture, leg)) for leg in robot.legs])
    if sequence.at_rest is None:
        n = robot.leg_count
        nothing = np.full(n, np.nan)
        joints = _of_joints(lift, list(robot.legs))
        touch = NORMAL_95 * np.hypot(UNEXPLAINED * np.linalg.norm(lift[:, :2], axis=(1, 2)), joints[0])
        return Foretold(
            rigid=True,
            start=sequence.T_site_base,
            end=T,
            stepped=stepped,
            hubs=hubs,
            normals=np.tile((0.0, 0.0, 1.0), (n, 1)),
            loads=nothing,
            touch_uncertainty=touch,
            load_uncertainty=nothing,
            drift_uncertainty=NORMAL_95 * joints[0],
            sink_uncertainty=NORMAL_95 * joints[1],
        )
    rest, soft = (_rest_after(robot, dem, sequence, rows, share) for share in (0.0, SPRINGS))
    standing = [leg for leg in robot.legs if rest.touching[leg]]
    joints = _of_joints(lift, standing)
    platform = platform_of(robot, rest, lift)
    heights = np.zeros(robot.leg_count)
    for leg in stepped:
        ground = height_deviation(dem, rest.contacts[leg, :2])
        heights[leg] = np.hypot(UNSTATED_SD if ground is None else ground, UNEXPLAINED * np.linalg.norm(lift[leg, 2]))
    sensor = LEAST_LOAD * robot.mass * _gravity(sequence)
    loads = np.hypot(np.linalg.norm(platform.loads * heights, axis=1), sensor)
    sink = np.hypot(joints[1], np.linalg.norm(platform.rise * heights))
    drift = np.hypot(joints[0], np.linalg.norm(platform.sway * heights))
    touch = np.hypot(UNEXPLAINED * np.linalg.norm(lift[:, :2], axis=(1, 2)), drift)
    moved = soft.T_site_base[:3, 3] - rest.T_site_base[:3, 3]
    return Foretold(
        rigid=False,
        start=sequence.T_site_base,
        end=rest.T_site_base,
        stepped=stepped,
        hubs=rest.hubs,
        normals=rest.normals,
        loads=rest.loads,
        touch_uncertainty=np.linalg.norm((soft.hubs - rest.hubs)[:, :2], axis=1) + NORMAL_95 * touch,
        load_uncertainty=np.abs(soft.loads - rest.loads) + NORMAL_95 * loads,
        drift_uncertainty=float(np.linalg.norm(moved[:2])) + NORMAL_95 * float(drift),
        sink_uncertainty=float(abs(moved[2])) + NORMAL_95 * float(sink),
    )


@dataclass(frozen=True)
class Platform:
    """A chassis on springs, as it answers to ground that is higher by little: [i, j] of what j is, upwards.

    loads: (legs, legs), on wheel i for ground under wheel j [N/m]; rise, sway: (legs,), of the chassis' middle, upwards
    and to the side [m/m].
    """

    loads: Array
    rise: Array
    sway: Array


def platform_of(robot: Robot, rest: RestingRover, lift: Array) -> Platform:
    """The rover as a platform of springs on the wheels that touch, held by friction.

    A leg is its joints' springs and its wheel's, one after the other, in all directions; the chassis is rigid.

    Args:
        robot: the rover.
        rest: of the rover, with its forces.
        lift: (legs, 3, 6), how a wheel moves in site with its leg's joints [m/rad].

    Returns:
        How loads and chassis follow ground that is higher under each wheel.
    """
    up = np.array((0.0, 0.0, 1.0))
    wheel = np.outer(up, up) / robot.description.wheel_stiffness
    yields = {
        int(leg): lift[leg] / rest.stiffness[6 * leg : 6 * leg + 6] @ lift[leg].T + wheel
        for leg in np.flatnonzero(rest.touching)
    }
    return platform(rest.contacts, rest.T_site_base[:3, 3], yields)


def platform(contacts: Array, middle: Array, yields: Mapping[int, Array]) -> Platform:
    """A chassis as a platform of springs on the feet that stand, held by friction.

    Args:
        contacts: of the feet, (legs, 3) in site [m].
        middle: of the chassis, (3,) in site [m].
        yields: by leg that stands, how its foot gives way to a force, (3, 3) in site [m/N].

    Returns:
        How loads and chassis follow ground that is higher under each foot.
    """
    A, K = np.zeros((len(contacts), 3, 6)), np.zeros((len(contacts), 3, 3))
    for leg, yielding in yields.items():
        x, y, z = contacts[leg] - middle
        A[leg] = np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
        K[leg] = np.linalg.inv(yielding)
    AtK = np.swapaxes(A, 1, 2) @ K
    # how the chassis moves and turns for ground that is higher under each wheel, (6, legs)
    moved = np.linalg.pinv(np.sum(AtK @ A, axis=0)) @ AtK[:, :, 2].T
    loads = np.diag(K[:, 2, 2]) - np.einsum("ik,kj->ij", (K @ A)[:, 2], moved)
    return Platform(loads, moved[2], np.linalg.norm(moved[:2], axis=0))


def _rest_after(robot: Robot, dem: Dem, sequence: Sequence, rows: int, softer: float) -> RestingRover:
    """The rover's rest after some rows, its springs softer by a share than was assumed."""
    made_with = sequence.provenance.settings
    settings = made_with if isinstance(made_with, SequenceSettings) else SequenceSettings()
    assumed = settings.compliance or ComplianceSettings()
    if softer:
        joints, wheels = (max(scale * (1 - softer), 1 / WIDEST) for scale in (assumed.joint_scale, assumed.wheel_scale))
        assumed = replace(assumed, joint_scale=joints, wheel_scale=wheels)
    commands: tuple[Command, ...] = sequence.commands[:rows]
    at_rest = sequence.at_rest
    if at_rest is None:
        raise InvalidInput("commands that take the rover as rigid predict no sag")
    found = follow(robot, at_rest, commands, dem, replace(settings, compliance=assumed), fitted=not softer)
    if found.rows[-1].reason:
        raise InvalidInput(f"the commands are not predicted to their end: {found.rows[-1].reason}")
    return found.rows[-1].rests[-1]


def _stepped(robot: Robot, sequence: Sequence, hubs: Array, rows: int) -> tuple[int, ...]:
    """The legs that stepped, and stand elsewhere in the end than they did."""
    before = apply(sequence.T_site_base, wheel_centers(robot, sequence.start))
    moved = {leg for leg in moved_legs(sequence)[:rows] if leg is not None}
    apart = np.linalg.norm(hubs - before, axis=1)
    return tuple(leg for leg in sorted(moved) if apart[leg] > ELSEWHERE)


def _turned(T: Array, J: Array) -> Array:
    return T[:3, :3] @ J


def _of_joints(lift: Array, standing: list[int]) -> tuple[float, float]:
    """Deviations of the chassis, seen from above and upwards [m]: every standing leg tells its pose."""
    own = UNEXPLAINED * lift[standing] / max(len(standing), 1)
    return float(np.linalg.norm(own[:, :2])), float(np.linalg.norm(own[:, 2]))


def _gravity(sequence: Sequence) -> float:
    made_with = sequence.provenance.settings
    compliance = made_with.compliance if isinstance(made_with, SequenceSettings) else None
    return (compliance or ComplianceSettings()).balance.gravity
