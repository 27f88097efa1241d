"""What is commanded: the predicted motion is the planned one, is what was asked of it, or is refused with a reason."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.forces import distribute
from footfall.core.errors import Cancelled, InvalidInput
from footfall.core.frames import apply, transform
from footfall.io.artifacts import decode, encode
from footfall.maps.standing import contacts, wheel_gaps
from footfall.planning.answers import Status
from footfall.planning.compliance.ball_contact import second_gaps
from footfall.planning.compliance.compliance_settings import ComplianceSettings
from footfall.planning.compliance.compliant_rover import CompliantRover
from footfall.planning.compliance.from_telemetry import measured
from footfall.planning.compliance.predict import predict
from footfall.planning.execution.execution_settings import MODES, ExecutionSettings
from footfall.planning.execution.pace import GENTLE, SWAY
from footfall.planning.execution.plan import plan_execution, rim_clearance
from footfall.planning.execution.problem import PHASES
from footfall.planning.step.problem import StepSettings
from footfall.robot.ik import contact_point
from footfall.robot.kinematics import center_of_mass, wheel_centers
from footfall.robot.meshes.collision import posture_collisions
from footfall.sequence.of_execution import sequence_of_execution
from footfall.sim.rover import SimulatedRover
from footfall.terrain.from_arrays import from_heights
from footfall.terrain.generate import plane
from footfall.terrain.ground.triangulate import triangulate
from tests.support.chassis_ground import wavy

LEG = 2


@pytest.fixture(scope="module")
def dem():
    return wavy()


@pytest.fixture(scope="module")
def rest(athlete, dem):
    """A rover that sags on Earth."""
    state = footfall.stand(athlete, dem)
    return CompliantRover(athlete, dem).let_down(state.posture, state.T_site_base)


@pytest.fixture(scope="module")
def state(athlete, dem, rest):
    return CompliantRover(athlete, dem).state(rest)


@pytest.fixture(scope="module")
def plan(athlete, dem, state):
    x, y, _ = apply(state.T_site_base, wheel_centers(athlete, state.posture))[LEG]
    result = footfall.plan_step(athlete, dem, state, LEG, (x + 0.1, y - 0.3))
    assert result.plan is not None, result.reason
    return result.plan


@pytest.fixture(scope="module")
def found(athlete, dem, state, rest, plan):
    return {
        mode: plan_execution(athlete, dem, state, plan, ExecutionSettings(mode=mode), rest.commanded) for mode in MODES
    }


def done_in(result):
    assert result.status is Status.FOUND, result.reason
    assert result.execution is not None
    assert all(check.holds for check in result.checks)
    return result.execution


def hubs_of(robot, execution):
    centers = [wheel_centers(robot, q)[execution.leg] for q in execution.predicted]
    return np.array([apply(T, c) for T, c in zip(execution.Ts_site_base, centers, strict=True)])


@pytest.mark.parametrize("mode", MODES)
def test_an_execution_is_whole(athlete, dem, state, rest, plan, found, mode):
    done = done_in(found[mode])
    count = len(done.phases)
    assert np.array_equal(done.commanded[0], rest.commanded)
    assert np.abs(done.predicted[0] - state.posture).max() < 1e-6
    order = [PHASES.index(phase) for phase in done.phases]
    assert order == sorted(order)
    assert set(done.phases) == set(PHASES)
    travel = np.abs(np.diff(done.commanded, axis=0))
    assert done.durations[0] == 0.0
    fastest = (travel / np.maximum(done.durations[1:, None], 1e-12)).max()
    assert fastest == pytest.approx(0.7 * 0.2)
    ends = [i for i in range(count) if i == count - 1 or done.phases[i + 1] != done.phases[i]]
    assert np.flatnonzero(done.pauses).tolist() == ends
    assert 12 < done.seconds < 25
    weight = (0.0, 0.0, athlete.mass * 9.81)
    assert np.abs(done.forces.sum(axis=1) - weight).max() < 1e-2
    # guarded lowering is one straight line in the joints, and ends where the wheel carries what stops it
    own = slice(6 * LEG, 6 * LEG + 6)
    origin, line = done.commanded[done.guarded_from, own], done.lowest - done.commanded[done.guarded_from, own]
    rows = done.commanded[done.guarded_from : done.stopped_at + 1, own] - origin
    shares = rows @ line / (line @ line)
    assert np.allclose(rows, shares[:, None] * line, atol=1e-12)
    assert (np.diff(shares) > 0).all()
    lifted = done.forces[done.guarded_from : done.stopped_at + 1, LEG, 2]
    assert lifted[-1] >= done.stop_force > lifted[-2]
    assert lifted[0] == 0.0
    assert done.forces[-1, LEG, 2] > 1000
    assert done.parents.keys() == {"plan", "state", "dem", "robot"}
    again = plan_execution(athlete, dem, state, plan, ExecutionSettings(mode=mode), rest.commanded)
    assert again.digest == found[mode].digest
    assert decode(encode(found[mode])).digest == found[mode].digest


@pytest.mark.parametrize("mode", MODES)
def test_the_prediction_is_that_of_the_set_points_alone(athlete, dem, state, rest, found, mode):
    done = done_in(found[mode])
    rover = CompliantRover(athlete, dem)
    motion = predict(rover, measured(rover, state, rest.commanded), done.commanded[1:])
    assert np.abs(motion.postures - done.predicted[1:]).max() < 1e-4
    assert np.abs(motion.Ts_site_base - done.Ts_site_base[1:]).max() < 1e-4


def test_as_commanded_sends_the_plan_and_the_wheel_comes_down_elsewhere(athlete, rest, plan, found):
    done = done_in(found["as_commanded"])
    own = slice(6 * LEG, 6 * LEG + 6)
    others = np.delete(done.commanded, np.s_[own], axis=1)
    assert (others == others[0]).all()
    sent = done.commanded[:, own]
    for i, phase in enumerate(done.plan.phases):
        if phase == "swing":
            assert np.abs(sent - done.plan.waypoints[i, own]).max(axis=1).min() < 1e-12
    swings = [i for i, phase in enumerate(done.phases) if phase == "swing"]
    assert 0.05 <= done.clearance[swings].min() < 0.12
    assert 0.01 < done.touch_down_offset < 0.1


def test_droop_aware_carries_the_wheel_where_it_was_planned(athlete, plan, found):
    done = done_in(found["droop_aware"])
    others = np.delete(done.commanded, np.s_[6 * LEG : 6 * LEG + 6], axis=1)
    assert (others == others[0]).all()
    planned = np.array([apply(plan.T_site_base, wheel_centers(athlete, q)[LEG]) for q in plan.waypoints])
    hubs = hubs_of(athlete, done)
    for i, phase in enumerate(plan.phases):
        if phase == "swing":
            assert np.linalg.norm(hubs - planned[i], axis=1).min() < 0.001
    assert done.touch_down_offset < 0.002
    # while the chassis sags
    assert np.linalg.norm(done.Ts_site_base[:, :3, 3] - plan.T_site_base[:3, 3], axis=1).max() > 0.02


def test_pose_held_keeps_the_chassis(athlete, plan, found):
    done = done_in(found["pose_held"])
    moved = np.linalg.norm(done.Ts_site_base[:, :3, 3] - plan.T_site_base[:3, 3], axis=1)
    # until the wheel that comes down pushes against it
    assert moved[: done.guarded_from + 1].max() < 0.0002
    assert moved.max() < 0.01
    assert moved[-1] < 0.001
    assert done.touch_down_offset < 0.002


def test_pose_held_gives_the_wheels_back_what_held_them(athlete, dem, rest, plan, state):
    """Set down where it stood, the leg changes nothing: also what the wheels push against one another comes again."""
    x, y, _ = contact_point(athlete, state.posture, LEG, state.T_site_base)
    back = footfall.plan_step(athlete, dem, state, LEG, (x, y))
    assert back.plan is not None, back.reason
    settings = ExecutionSettings(mode="pose_held")
    done = done_in(plan_execution(athlete, dem, state, back.plan, settings, rest.commanded))
    weight = athlete.mass * 9.81
    assert np.abs(done.forces[-1] - done.forces[0]).max() < 0.004 * weight
    # which is not what forces of least norm would be
    feet = contacts(athlete, dem, state.posture, state.T_site_base, range(6))
    com = apply(state.T_site_base, center_of_mass(athlete, state.posture))
    least = distribute(feet.points, feet.normals, com, athlete.mass)
    assert np.abs(least - done.forces[0]).max() > 0.01 * weight


@pytest.mark.parametrize("mode", MODES)
def test_where_it_is_predicted_nothing_collides(athlete, dem, found, mode):
    """Meshes posture by posture; wheels that stand, or are about to, are pressed into the ground."""
    done = done_in(found[mode])
    near = triangulate(dem)
    for i in range(0, len(done.phases), 6):
        hits = posture_collisions(athlete, done.predicted[i], done.Ts_site_base[i], near)
        wheels = {f"leg{leg}_wheel" for leg in athlete.legs if leg != LEG or done.phases[i] != "swing"}
        assert [hit for hit in hits if not (hit.link_a in wheels and hit.link_b == "terrain")] == []


def test_clearance_is_what_the_wheels_mesh_shows(athlete, dem, found):
    done = done_in(found["droop_aware"])
    for i in [i for i, phase in enumerate(done.phases) if phase == "swing"][::4]:
        gap = wheel_gaps(athlete, dem, done.predicted[i], done.Ts_site_base[i], [LEG])[0]
        # the wheel's tread is flat and may lean: its edge is a little lower than a ball's lowest point
        assert gap - 0.001 <= done.clearance[i] < gap + 0.03
    assert (done.clearance_uncertainty[np.array(done.phases) == "swing"] > 0.005).all()
    flat = plane(size=4.0, resolution=0.05)
    assert rim_clearance(flat, np.array([[0.0, 0.0, 0.5], [0.3, 0.2, 0.2]]), 0.242) == pytest.approx([0.258, -0.042])
    x = np.arange(-2, 2.01, 0.01)
    step = from_heights(np.where(x > 0.1, 0.3, 0.0)[None].repeat(len(x), 0).astype(np.float32), 0.01, -2.0, -2.0)
    # a ball beside a step rests on its edge
    edge = 0.5 - 0.3 - np.sqrt(0.242**2 - 0.1**2)
    assert rim_clearance(step, np.array([[0.0, 0.0, 0.5]]), 0.242)[0] == pytest.approx(edge, abs=0.01)
    assert np.isnan(rim_clearance(flat, np.array([[50.0, 0.0, 0.5]]), 0.242)).all()


def test_wrong_stiffness_and_mass_move_the_touch_down_by_little(athlete, dem, rest, state, found):
    for joint, wheel, payload in ((0.8, 0.7, 0.0), (1.2, 1.3, 40.0)):
        balance = BalanceSettings(payload_mass=payload)
        rover = CompliantRover(athlete, dem, ComplianceSettings(joint_scale=joint, wheel_scale=wheel, balance=balance))
        for mode, most in (("droop_aware", 0.03), ("pose_held", 0.03)):
            done = done_in(found[mode])
            truth = predict(rover, measured(rover, state, rest.commanded), done.commanded[1:])
            assert truth.reason == ""
            first = next(r for r in truth.rests[done.guarded_from :] if r.touching[LEG])
            assert np.linalg.norm((first.contacts[LEG] - done.plan.contact)[:2]) < most


def test_a_soft_rover_is_lifted_higher_or_refused(athlete, dem, rest, plan):
    soft = ComplianceSettings(joint_scale=0.8)
    rover = CompliantRover(athlete, dem, soft)
    stood = footfall.stand(athlete, dem)
    sagged = rover.let_down(stood.posture, stood.T_site_base)
    state = rover.state(sagged)
    result = footfall.plan_step(athlete, dem, state, LEG, tuple(plan.contact[:2]))
    assert result.plan is not None, result.reason
    settings = ExecutionSettings(mode="as_commanded", compliance=soft)
    done = done_in(plan_execution(athlete, dem, state, result.plan, settings, sagged.commanded))
    made_with = done.plan.provenance.settings
    assert isinstance(made_with, StepSettings)
    assert made_with.lift > 0.21
    assert min(c for c, phase in zip(done.clearance, done.phases, strict=True) if phase == "swing") >= 0.05
    low = replace(settings, most_lift=0.2)
    refused = plan_execution(athlete, dem, state, result.plan, low, sagged.commanded)
    assert refused.status is Status.NO_PATH
    assert "wheel clearance by 0.0" in refused.reason
    assert "higher lift" in refused.reason
    assert refused.execution is not None


@pytest.mark.parametrize("mode", MODES)
def test_phases_end_at_half_speed_and_lowering_is_slow(athlete, found, mode):
    done = done_in(found[mode])
    fast = np.append(0.0, np.abs(np.diff(done.commanded, axis=0)).max(axis=1)) / (0.7 * 0.2)
    for phase in ("unload", "lift", "swing", "load"):
        rows = np.array([i for i, name in enumerate(done.phases) if name == phase and i > 0])
        halved = done.durations[rows] > 1.5 * fast[rows]
        assert np.allclose(done.durations[rows], np.where(halved, 2.0, 1.0) * fast[rows])
        # the last of them, for half a period of sway
        assert (np.diff(halved.astype(int)) >= 0).all()
        slow = done.durations[rows][halved].sum()
        assert slow >= SWAY or halved.all()
        assert slow - done.durations[rows][halved][0] < SWAY
    lowered = slice(done.guarded_from + 1, done.stopped_at + 1)
    fall = done.clearance[done.guarded_from] - done.clearance[done.stopped_at]
    assert fall / done.durations[lowered].sum() < 1.3 * GENTLE


def test_the_force_that_stops_the_lowering_is_a_share_of_the_weight(athlete, dem, plan, found):
    moon = ComplianceSettings(balance=BalanceSettings(gravity=1.62))
    rover = CompliantRover(athlete, dem, moon)
    state = footfall.stand(athlete, dem)
    rest = rover.let_down(state.posture, state.T_site_base)
    settings, state = ExecutionSettings(compliance=moon), rover.state(rest)
    there = footfall.plan_step(athlete, dem, state, LEG, (plan.contact[0], plan.contact[1])).plan
    assert there is not None
    done = done_in(plan_execution(athlete, dem, state, there, settings, rest.commanded))
    assert done.stop_force == pytest.approx(settings.stop_share * athlete.mass * 1.62 / 6)
    assert done.stop_force == pytest.approx(done_in(found["droop_aware"]).stop_force * 1.62 / 9.81)
    # it is felt only when the wheel is on the ground, and far below what the wheel bears in the end
    assert done.clearance[done.stopped_at] < 0
    assert done.loads[-1, LEG] > 3 * done.stop_force


def test_what_cannot_be_is_refused_with_a_reason(athlete, dem, state, rest, plan):
    def asked(settings=None, now=state, **changes):
        return plan_execution(athlete, dem, now, plan, settings or ExecutionSettings(**changes), rest.commanded)

    shallow = asked(overshoot=0.002, stop_share=0.7)
    assert shallow.status is Status.NO_PATH
    assert "touch-down by" in shallow.reason
    assert "more overshoot" in shallow.reason
    heavy = asked(compliance=ComplianceSettings(balance=BalanceSettings(payload_mass=300.0)), least_load=2500.0)
    assert "load on the supporting wheels by" in heavy.reason
    away = asked(now=replace(state, T_site_base=transform(translation=(0.1, 0, 0)) @ state.T_site_base))
    assert away.status is Status.START_INVALID
    assert "0.100 m from where the plan starts" in away.reason
    forces = np.array(state.wheel_forces)
    forces[1:5] = 0.0
    hanging = asked(now=replace(state, wheel_forces=forces))
    assert hanging.status is Status.START_INVALID
    assert "three legs must be pressed" in hanging.reason


def test_a_standing_wheel_that_leans_against_a_rock_is_refused_unless_the_chassis_is_held(
    athlete, dem, state, rest, plan
):
    other = (LEG + 3) % 6
    rim = rest.rims[other]
    outward = rim[:2] - state.T_site_base[:2, 3]
    outward /= np.linalg.norm(outward)
    X, Y = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    beyond = (X - rim[0]) * outward[0] + (Y - rim[1]) * outward[1]
    beside = np.abs((X - rim[0]) * outward[1] - (Y - rim[1]) * outward[0]) < 0.3

    def with_rock(height):
        raised = np.where((beyond > 0.12) & (beyond < 0.5) & beside, height, 0.0)
        return replace(dem, heights=(dem.heights + raised).astype(np.float32))

    def gap(height):
        return second_gaps(with_rock(height), rim[None], rest.contacts[other][None], athlete.wheel_radius)[0]

    def asked(height, mode):
        return plan_execution(athlete, with_rock(height), state, plan, ExecutionSettings(mode=mode), rest.commanded)

    heights = np.arange(0.0, 0.2, 0.001)
    free, leaning = (next(h for h in heights[::-1] if gap(h) > least) for least in (0.006, 0.0005))
    assert gap(leaning) < 0.003 < gap(free)
    for mode in MODES:
        done_in(asked(free, mode))
    done_in(asked(leaning, "pose_held"))
    for mode in ("droop_aware", "as_commanded"):
        refused = asked(leaning, mode)
        assert refused.status is Status.NO_PATH
        assert "wheels on one side of the ground by 0.00" in refused.reason
        assert f"leg {other} leans against another" in refused.reason
        assert "take the mode pose_held" in refused.reason


@pytest.mark.parametrize("mode", ["droop_aware", "pose_held"])
def test_a_rover_that_does_not_yield_at_all_drags_no_wheel(athlete, dem, mode):
    rigid = SimulatedRover(athlete, dem, footfall.stand(athlete, dem)).frame()
    x, y, _ = apply(rigid.state.T_site_base, wheel_centers(athlete, rigid.state.posture))[LEG]
    step = footfall.plan_step(athlete, dem, rigid.state, LEG, (x + 0.1, y - 0.3)).plan
    assert step is not None
    found = plan_execution(athlete, dem, rigid.state, step, ExecutionSettings(mode=mode), rigid.commanded)
    made = sequence_of_execution(done_in(found), athlete, dem)
    assert [rule for rule in made.rules if not rule.holds] == []
    drag = [rule for rule in made.rules if rule.rule == "no-drag"]
    assert drag


def test_misuse_is_named(athlete, dem, state, plan, rest):
    with pytest.raises(InvalidInput, match="mode is one of pose_held"):
        ExecutionSettings(mode="slowly")
    with pytest.raises(InvalidInput, match="speed_fraction must be"):
        ExecutionSettings(speed_fraction=1.5)
    with pytest.raises(InvalidInput, match="tolerance must be"):
        ExecutionSettings(tolerance=1.0)
    with pytest.raises(InvalidInput, match="least_load can't be negative"):
        ExecutionSettings(least_load=-1.0)
    with pytest.raises(InvalidInput, match="overshoot must be above zero"):
        ExecutionSettings(overshoot=0.0)
    with pytest.raises(InvalidInput, match="the state is of other"):
        plan_execution(athlete, dem, replace(state, robot="other"), plan)
    of_another = replace(plan, provenance=replace(plan.provenance, parents={**plan.parents, "robot": "0" * 32}))
    with pytest.raises(InvalidInput, match="made for another robot"):
        plan_execution(athlete, dem, state, of_another)

    def cancel(fraction, text):
        if "gives way" in text:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        plan_execution(athlete, dem, state, plan, commanded=rest.commanded, progress=cancel)
