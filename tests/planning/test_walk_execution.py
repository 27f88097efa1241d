"""A walk of a rover that sags: each foot move from the rest that the one before ends in, or a refusal that names it."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.frames import apply, transform
from footfall.io.artifacts import decode, encode
from footfall.planning.answers import Check, Status, least_of
from footfall.planning.body.body_move import No
from footfall.planning.body.move import BodyMovePlan
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.compliance.predict import advanced, predict
from footfall.planning.execution.begin import beginning
from footfall.planning.execution.body_plan import body_executed
from footfall.planning.execution.execution_settings import ExecutionSettings
from footfall.planning.step.problem import StepPlan
from footfall.planning.walk.parts import parts_of, stay
from footfall.planning.walk.problem import Place, WalkGoal, WalkSettings
from footfall.planning.walk_execution.onward import next_that_moves, onward
from footfall.planning.walk_execution.plan import foot_moves_of, plan_walk_execution
from footfall.planning.walk_execution.problem import FootMoveExecution, WalkExecution
from footfall.planning.walk_execution.unpressed import unpressed
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.of_execution import sequence_of_execution
from tests.support.chassis_ground import wavy

HELD = ("pose_held", "droop_aware")
FRICTION = 0.6


@pytest.fixture(scope="module")
def dem():
    return wavy()


@pytest.fixture(scope="module")
def rest(athlete, dem):
    state = footfall.stand(athlete, dem)
    return CompliantRover(athlete, dem).let_down(state.posture, state.T_site_base)


@pytest.fixture(scope="module")
def state(athlete, dem, rest):
    return CompliantRover(athlete, dem).state(rest)


@pytest.fixture(scope="module")
def walk(athlete, dem, state):
    result = footfall.plan_walk(athlete, dem, state, goal=(0.4, 0.1, 0.0), seed=1)
    assert result.plan is not None, result.reason
    assert result.plan.foot_moves >= 2
    return result.plan


@pytest.fixture(scope="module")
def found(athlete, dem, state, rest, walk):
    return {
        mode: plan_walk_execution(athlete, dem, state, walk, ExecutionSettings(mode=mode), rest.commanded)
        for mode in HELD
    }


def done_in(result):
    assert result.status is Status.FOUND, result.reason
    assert all(check.holds for check in result.checks)
    assert result.execution is not None
    return result.execution


def hubs_of(robot, done, at):
    return apply(done.Ts_site_base[at], wheel_centers(robot, done.predicted[at]))


@pytest.mark.parametrize("mode", HELD)
def test_every_part_starts_where_the_one_before_ends(athlete, walk, rest, found, mode):
    done = done_in(found[mode])
    assert [one.number for one in done.moves] == list(range(walk.foot_moves + 1))
    assert [one.step.leg for one in done.moves if one.step] == list(walk.legs)
    assert np.array_equal(done.parts[0].commanded[0], rest.commanded)
    assert [one.plan.digest for one in done.parts] == [one.digest for one in parts_of(walk)]
    for before, after in zip(done.parts[:-1], done.parts[1:], strict=True):
        assert np.array_equal(before.commanded[-1], after.commanded[0])
        assert np.array_equal(before.predicted[-1], after.predicted[0])
        assert np.array_equal(before.Ts_site_base[-1], after.Ts_site_base[0])
        assert np.array_equal(before.forces[-1], after.forces[0])
    assert done.seconds == pytest.approx(sum(one.seconds for one in done.parts))
    weight = (0.0, 0.0, athlete.mass * 9.81)
    for part in done.parts:
        assert np.abs(part.forces.sum(axis=1) - weight).max() < 1e-2


@pytest.mark.parametrize("mode", HELD)
def test_the_prediction_of_the_whole_walk_is_that_of_its_set_points_alone(athlete, dem, state, rest, found, mode):
    done = done_in(found[mode])
    rover = CompliantRover(athlete, dem)
    commanded = np.concatenate([part.commanded[1:] for part in done.parts])
    motion = predict(rover, measured(rover, state, rest.commanded), commanded)
    assert not motion.reason
    poses = np.concatenate([part.Ts_site_base[1:] for part in done.parts])
    assert np.linalg.norm(motion.Ts_site_base[:, :3, 3] - poses[:, :3, 3], axis=1).max() < 1e-4
    forces = np.concatenate([part.forces[1:] for part in done.parts])
    assert np.abs(motion.forces - forces).max() < 5.0


def test_chassis_and_feet_are_where_the_walk_has_them(athlete, walk, found):
    done = done_in(found["pose_held"])
    radius = athlete.wheel_radius
    for move in done.moves:
        planned = walk.Ts_site_base[np.flatnonzero(walk.moves == move.number)[-1]]
        for part in move.parts:
            away = part.Ts_site_base[-1, :3, 3] - planned[:3, 3]
            assert np.linalg.norm(away) < 0.003
        if move.step is not None:
            held = np.linalg.norm(move.step.Ts_site_base[:, :3, 3] - planned[:3, 3], axis=1)
            # as it is lowered the wheel takes some load before the others are told to give it up
            lowering = np.array([phase == "lower" for phase in move.step.phases])
            assert held[~lowering].max() < 0.003
            assert held.max() < 0.01
            stance = walk.stances[move.number + 1]
            hub = hubs_of(athlete, move.step, -1)[move.step.leg]
            off = hub - (stance.contacts + radius * stance.normals)[move.step.leg]
            assert np.linalg.norm(off[:2]) < 0.01
            # the wheel is pressed in by what it bears
            assert -off[2] == pytest.approx(
                move.step.loads[-1, move.step.leg] / athlete.description.wheel_stiffness, abs=0.008
            )


def test_wheels_that_stand_stay(athlete, found):
    """Their middles go by what the springs give way, and by what the wheels roll as the chassis sags."""
    for mode, rolled in (("pose_held", 1e-3), ("droop_aware", 5e-3)):
        for part in done_in(found[mode]).parts:
            moved = getattr(part, "leg", None)
            way = hubs_of(athlete, part, -1) - hubs_of(athlete, part, 0)
            given_way = -(part.forces[-1] - part.forces[0]) / athlete.description.wheel_stiffness
            stood = [leg for leg in athlete.legs if leg != moved]
            assert np.abs(way - given_way)[stood].max() < rolled


def test_a_stretch_is_that_part_of_the_walk(athlete, dem, state, rest, walk, found):
    asked = ExecutionSettings()
    whole = done_in(found["pose_held"])
    head = done_in(plan_walk_execution(athlete, dem, state, walk, asked, rest.commanded, 0, 1))
    assert [one.digest for one in head.moves] == [whole.moves[0].digest]
    last = whole.moves[0].parts[-1]
    between = replace(
        state,
        posture=last.predicted[-1],
        T_site_base=last.Ts_site_base[-1],
        wheel_forces=last.forces[-1],
        joint_torques=athlete.stiffness * (last.commanded[-1] - last.predicted[-1]),
    )
    tail = done_in(plan_walk_execution(athlete, dem, between, walk, asked, last.commanded[-1], 1))
    assert [one.number for one in tail.moves] == [one.number for one in whole.moves[1:]]
    for one, other in zip(tail.parts, whole.parts[len(whole.moves[0].parts) :], strict=True):
        assert np.abs(one.predicted[-1] - other.predicted[-1]).max() < 2e-3


def test_it_is_stored_and_done_again_alike(athlete, dem, state, rest, walk, found):
    result = found["pose_held"]
    assert decode(encode(result)).digest == result.digest
    again = plan_walk_execution(athlete, dem, state, walk, ExecutionSettings(), rest.commanded)
    assert again.digest == result.digest
    assert done_in(result).parents.keys() == {"walk", "state", "dem", "robot"}


def test_a_foot_move_becomes_commands_that_lead_where_it_does(athlete, dem, found):
    move = done_in(found["pose_held"]).moves[0]
    assert move.step is not None
    told = sequence_of_execution(move, athlete, dem)
    assert {one.phase for one in told.commands} == {"", "body", "unload", "lift", "swing", "lower", "load"}
    assert not told.failures
    assert np.abs(told.predicted[-1] - move.step.predicted[-1]).max() < 2e-3
    assert told.duration >= move.seconds


def test_what_fails_is_told_and_what_is_before_it_kept(athlete, dem, state, rest, walk, found):
    steps = [move.step for move in done_in(found["pose_held"]).moves if move.step]
    least = [step.clearance[[phase == "swing" for phase in step.phases]].min() for step in steps]
    limit = float(np.sort(least)[1] + np.sort(least)[0]) / 2
    worst = int(np.argmin(least))
    result = plan_walk_execution(athlete, dem, state, walk, ExecutionSettings(least_clearance=limit), rest.commanded)
    assert result.status is Status.NO_PATH
    assert result.failed_at == worst
    assert f"foot move {worst + 1}: " in result.reason
    assert "wheel clearance" in result.reason
    assert "higher lift" in result.reason
    kept = () if result.execution is None else result.execution.moves
    assert [one.number for one in kept] == list(range(worst))
    assert [check.name for check in result.checks if not check.holds] == ["wheel clearance"]


def test_a_rover_elsewhere_is_refused_and_goes_on_by_a_new_walk(athlete, dem, state, rest, walk):
    rover = CompliantRover(athlete, dem)
    away = rover.let_down(state.posture, transform(translation=(0.0, 0.08, 0.03)) @ state.T_site_base)
    elsewhere = rover.state(away)
    refused = plan_walk_execution(athlete, dem, elsewhere, walk, commanded=away.commanded)
    assert refused.status is Status.START_INVALID
    assert refused.failed_at == 0
    assert "from where it starts" in refused.reason
    found = onward(athlete, dem, elsewhere, walk, 0, commanded=away.commanded)
    assert found.move is not None, found.reason
    assert found.anew == refused.reason
    assert found.walk.goal.digest == walk.goal.digest
    assert found.walk.digest != walk.digest
    assert np.abs(found.move.parts[0].predicted[0] - elsewhere.posture).max() < 1e-6


def test_a_new_walk_is_not_asked_for_pinned_places_that_have_had_their_foot(athlete, dem, state, walk):
    put = [(leg, walk.stances[at + 1].contacts[leg]) for at, leg in enumerate(walk.legs[:2])]
    pins = tuple(Place(float(x), float(y), 0.1, leg) for leg, (x, y, _) in put)
    settings = replace(walk.provenance.settings, pinned=pins)
    pinned = replace(walk, provenance=replace(walk.provenance, settings=settings))
    rover = CompliantRover(athlete, dem)
    away = rover.let_down(state.posture, transform(translation=(0.0, 0.08, 0.03)) @ state.T_site_base)
    found = onward(athlete, dem, rover.state(away), pinned, 1, commanded=away.commanded)
    assert found.anew
    asked = found.walk.provenance.settings
    assert isinstance(asked, WalkSettings)
    assert [one.digest for one in asked.pinned] == [pins[1].digest]


def test_the_walk_is_kept_where_it_fits_and_ends(athlete, dem, state, rest, walk, found):
    now = onward(athlete, dem, state, walk, 0, commanded=rest.commanded)
    assert (now.walk, now.number, now.anew, now.reason) == (walk, 0, "", "")
    assert now.move is not None
    assert now.move.digest == done_in(found["pose_held"]).moves[0].digest
    over = onward(athlete, dem, state, walk, walk.foot_moves + 1)
    assert over.move is None
    assert not over.reason
    assert next_that_moves(walk, 0) == 0
    assert next_that_moves(walk, walk.foot_moves + 1) is None


def test_no_way_on_says_both_reasons(athlete, dem, state, rest, walk):
    off = replace(walk, goal=WalkGoal(50.0, 0.0))
    rover = CompliantRover(athlete, dem)
    away = rover.let_down(state.posture, transform(translation=(0.0, 0.08, 0.03)) @ state.T_site_base)
    found = onward(athlete, dem, rover.state(away), off, 0, commanded=away.commanded)
    assert found.move is None
    assert "foot move 1" in found.reason
    assert "off the map" in found.reason


def test_wheels_that_are_not_pressed_in_stand_where_the_ground_holds_their_rims(athlete, dem, state, rest):
    freed = unpressed(athlete, state)
    assert np.array_equal(freed.T_site_base, state.T_site_base)
    hubs = apply(freed.T_site_base, wheel_centers(athlete, freed.posture))
    assert np.abs(hubs - rest.rims).max() < 1e-6
    # a rigid rover stands on the map there, and wheels are turned as they were
    below, normals, _ = CompliantRover(athlete, dem).ground_under(freed.posture, freed.T_site_base)
    assert np.abs(np.sum((hubs - below) * normals, axis=1) - athlete.wheel_radius).max() < 2e-3
    turns = [CompliantRover(athlete, dem).wheels(one.posture, one.T_site_base)[1] for one in (freed, state)]
    assert np.allclose(turns[0], turns[1], atol=1e-9)
    weightless = replace(state, wheel_forces=np.zeros_like(state.wheel_forces))
    assert np.allclose(unpressed(athlete, weightless).posture, state.posture, atol=1e-9)


def test_foot_moves_are_the_parts_in_order(walk):
    moves = foot_moves_of(walk)
    assert len(moves) == walk.foot_moves + 1
    assert [one.digest for parts in moves for one in parts] == [one.digest for one in parts_of(walk)]


def test_the_least_check_of_each_name_counts():
    checks = [Check("a", True, 0.3, "m", "x"), Check("b", True, 1.0, "N", "y"), Check("a", True, 0.1, "m", "z")]
    assert [(one.name, one.where) for one in least_of(checks)] == [("a", "z"), ("b", "y")]


def test_misuse_raises_and_cancelling_ends_it(athlete, dem, state, rest, walk, found):
    with pytest.raises(InvalidInput, match="mode"):
        plan_walk_execution(athlete, dem, state, walk, ExecutionSettings(mode="as_commanded"))
    with pytest.raises(InvalidInput, match="robot"):
        plan_walk_execution(athlete, dem, replace(state, robot="other"), walk)
    for first, count in ((-1, None), (walk.foot_moves + 1, None), (0, walk.foot_moves + 2), (0, 0)):
        with pytest.raises(InvalidInput, match="foot moves"):
            plan_walk_execution(athlete, dem, state, walk, first=first, count=count)
    with pytest.raises(InvalidInput, match="moves nothing"):
        FootMoveExecution(0, None, None)
    moves = done_in(found["pose_held"]).moves
    with pytest.raises(InvalidInput, match="neighbouring"):
        WalkExecution((moves[0], moves[2]), walk.provenance)
    told = []

    def cancel(share, text):
        told.append((share, text))
        if "foot move 2" in text:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        plan_walk_execution(athlete, dem, state, walk, commanded=rest.commanded, progress=cancel)
    shares = [share for share, _ in told]
    assert shares == sorted(shares)


@pytest.fixture(scope="module")
def from_step(walk):
    """The walk begun where its first step is."""
    k = int(np.flatnonzero([phase != "body" for phase in walk.phases])[0]) - 1
    rows = {name: getattr(walk, name)[k:] for name in ("waypoints", "Ts_site_base", "moves", "margins", "torques")}
    return replace(walk, phases=("body", *walk.phases[k + 1 :]), **rows)


def test_the_chassis_can_stay_where_a_step_begins(walk, from_step):
    for plan in (walk, from_step):
        for number in range(plan.foot_moves):
            step = next(one for one in foot_moves_of(plan)[number] if isinstance(one, StepPlan))
            still = stay(plan, number)
            assert np.array_equal(still.waypoints, [step.waypoints[0]] * 2)
            assert np.array_equal(still.Ts_site_base, [step.T_site_base] * 2)
            assert np.array_equal(still.contacts, plan.stances[number].contacts)
            assert np.allclose(still.shift.vector, 0.0, atol=1e-12)


def test_strain_is_taken_out_of_legs_before_a_step_that_it_would_spoil(athlete, dem, state, rest, walk, from_step):
    assert len(foot_moves_of(from_step)[0]) == 1
    rover, body_move = CompliantRover(athlete, dem), parts_of(walk)[0]
    assert isinstance(body_move, BodyMovePlan)
    began = beginning(athlete, dem, state, ExecutionSettings(), rest.commanded)
    assert not isinstance(began, No)
    rest = body_executed(began, body_move, ExecutionSettings(), body_move.provenance).end
    assert rest is not None
    leg = next(leg for leg in athlete.legs if leg != from_step.legs[0])
    target = np.array(rest.commanded)
    target[6 * leg] += 0.08
    strained = advanced(rover, rest, target)
    assert strained.settled

    def use(forces, normals):
        loads = np.sum(forces * normals, axis=-1, keepdims=True)
        sideways = np.linalg.norm(forces - loads * normals, axis=-1)
        return sideways / (FRICTION * np.maximum(loads[..., 0], 1e-9))

    begins = use(strained.forces, strained.normals)[leg]
    asked = ExecutionSettings(spare_friction=1.0 - 0.9 * begins)
    done = done_in(
        plan_walk_execution(athlete, dem, rover.state(strained), from_step, asked, strained.commanded, count=1)
    )
    body, step = done.moves[0].body, done.moves[0].step
    assert body is not None
    assert step is not None
    assert np.array_equal(body.commanded[0], strained.commanded)
    # it stays where it is and lets go
    assert np.linalg.norm(body.Ts_site_base[-1, :3, 3] - from_step.Ts_site_base[0, :3, 3]) < 0.01
    assert body.friction_use[-1].max() <= 0.9 * begins
    assert step.friction_use[:, [one for one in athlete.legs if one != step.leg]].max() <= 0.9 * begins
    # unstrained, it needs none of that
    plain = done_in(
        plan_walk_execution(athlete, dem, rover.state(rest), from_step, asked, rest.commanded, count=1)
    ).moves[0]
    assert plain.body is None
