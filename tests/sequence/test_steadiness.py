"""Margins along plans and sequences: against what the planner and the rules found of the same motion on their own."""

from dataclasses import replace

import numpy as np
import pytest

import footfall
from footfall.balance.support import margin
from footfall.core.frames import apply
from footfall.maps.standing import contacts
from footfall.planning.walk.problem import WalkResult, WalkSettings
from footfall.robot.description import with_payload
from footfall.robot.kinematics import center_of_mass, wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.steadiness_course import ON_A_TETHER, SAMPLING, course_of
from footfall.session.core import present
from footfall.session.jobs.local import InlineJobs
from footfall.session.products.kinds import WALK
from footfall.session.registry import Sessions
from footfall.session.steadiness import along
from tests.support.chassis_ground import wavy

LEG = 2


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def planned(athlete, ground):
    stood = footfall.stand(athlete, ground)
    foot = apply(stood.T_site_base, wheel_centers(athlete, stood.posture))[LEG]
    found = footfall.plan_step(athlete, ground, stood, LEG, (float(foot[0] + 0.2), float(foot[1] + 0.1)), seed=1)
    assert found.plan is not None, found.reason
    return found


def test_the_worst_moment_of_a_plan_is_what_its_check_of_balance_found(athlete, ground, planned):
    course = course_of(athlete, ground, planned.plan)
    check = next(one for one in planned.checks if "balance" in one.name)
    worst = course.worst("plain")
    # the check looks four times as often
    assert course.margins["plain"][worst] == pytest.approx(check.margin, abs=1e-3)
    assert f"waypoint {course.rows[worst] + 1}" in check.where


def test_each_moment_has_the_margin_of_its_posture(athlete, ground, planned):
    """At waypoints, from the posture alone: the centre of mass over the five other wheels."""
    plan = planned.plan
    course = course_of(athlete, ground, plan)
    others = [leg for leg in athlete.legs if leg != LEG]
    feet = contacts(athlete, ground, plan.waypoints[0], plan.T_site_base, others).points
    travel = np.abs(np.diff(plan.waypoints, axis=0)).max(axis=1)
    moments = np.concatenate([[0.0], np.cumsum(travel)]) / travel.sum()
    for posture, moment in zip(plan.waypoints, moments, strict=True):
        com = apply(plan.T_site_base, center_of_mass(athlete, posture))
        at = int(np.argmin(np.abs(course.moments - moment)))
        assert course.moments[at] == pytest.approx(moment, abs=1e-9)
        for outline, lost in (("plain", False), ("conservative", True)):
            assert course.margins[outline][at] == pytest.approx(margin(feet, com[:2], lost), abs=1e-9)
    assert (np.diff(course.moments) >= 0).all()
    assert np.diff(course.moments).max() <= SAMPLING / travel.sum() + 1e-9


def test_the_worst_row_of_a_sequence_is_that_of_its_rule(athlete, ground, planned):
    sequence = footfall.make_sequence(planned.plan, athlete, ground)
    told = {rule.row: rule.margin for rule in sequence.rules if rule.rule == "balance"}
    assert told
    course = course_of(athlete, ground, sequence)
    for row, spare in told.items():
        found = course.margins["plain"][course.rows == row].min()
        assert found == pytest.approx(spare, abs=2e-3)
    assert course.rows[course.worst("plain")] == min(told, key=lambda row: told[row])


def test_a_row_that_moves_nothing_stands_on_every_wheel(athlete, ground, planned):
    step = footfall.make_sequence(planned.plan, athlete, ground)
    wait = replace(step.commands[0], name="WAIT", leg=None, joints=None, phase="")
    predicted = np.vstack([step.start, step.predicted[:1]])
    course = course_of(athlete, ground, replace(step, commands=(wait, step.commands[0]), predicted=predicted))
    stood, lifting = (course.margins["plain"][course.rows == row] for row in (0, 1))
    feet = contacts(athlete, ground, step.start, step.T_site_base, athlete.legs).points
    com = apply(step.T_site_base, center_of_mass(athlete, step.start))
    assert stood == pytest.approx(margin(feet, com[:2]), abs=1e-9)
    assert lifting.max() < stood.min() - 0.2


@pytest.fixture(scope="module")
def walk(athlete, ground):
    # what a busy machine takes is no matter
    settings = WalkSettings(seed=4, time_limit=3600.0)
    found = footfall.plan_walk(athlete, ground, footfall.stand(athlete, ground), (0.4, 0.1, 0.0), settings=settings)
    assert found.plan is not None, found.reason
    return found.plan


def test_along_a_walk_the_polygon_s_margin_is_the_planner_s(athlete, ground, walk):
    plan = walk
    course = course_of(athlete, ground, plan)
    travel = np.abs(np.diff(plan.waypoints, axis=0)).max(axis=1)
    for row in range(len(travel)):
        found = course.margins["plain"][course.rows == row]
        # of a swing, which is one motion, the planner tells the least
        least = found.min() if plan.phases[row + 1] == "swing" else found[-1]
        assert least == pytest.approx(plan.margins[row + 1], abs=2e-3)
    np.testing.assert_allclose(
        [course.moments[course.rows == row][-1] for row in range(len(travel))], np.cumsum(travel) / travel.sum()
    )


def test_a_walk_s_payload_counts_as_if_the_description_carried_it(athlete, ground, walk):
    place = np.array([0.3, 0.9, 0.3])
    described = Robot(with_payload(athlete.description, 150.0, position=place))
    settings = replace(walk.provenance.settings, payload_mass=150.0, payload_position=place)
    laden = replace(walk, provenance=replace(walk.provenance, settings=settings))
    course, same = course_of(athlete, ground, laden), course_of(described, ground, walk)
    for outline, margins in course.margins.items():
        np.testing.assert_allclose(margins, same.margins[outline], atol=1e-9)
    bare = course_of(athlete, ground, walk)
    assert course.margins["plain"][0] < bare.margins["plain"][0] - 0.05


def test_a_walk_on_a_tether_is_judged_as_it_was_planned(athlete, tmp_path):
    """The sample's: by its planner's margins, along its slope's normal; so are its commands. Friction is not known."""
    with Sessions(tmp_path, InlineJobs()) as sessions:
        live = sessions.open_sample("rappel")
        digest = present(live.state.newest(WALK), "no walk")
        plan = live.typed(WalkResult, digest).plan
        assert plan is not None
        found = along(live, digest).course
        travel = np.abs(np.diff(plan.waypoints, axis=0)).max(axis=1)
        moments = np.concatenate([[0.0], np.cumsum(travel)]) / travel.sum()
        least = [found.margins["plain"][np.abs(found.moments - moment) < 1e-9].min() for moment in moments[1:]]
        assert np.min(least) == pytest.approx(plan.margins.min(), abs=0.02)
        assert found.margins["plain"].min() > 0.3
        assert np.isnan(found.margins["friction"]).all()
        assert found.why["friction"] == ON_A_TETHER
        commands = live.walks.command(digest, 0, 3, as_commanded=True)
        of_commands = along(live, commands).course
        assert of_commands.margins["plain"].min() > 0.3
        assert np.isnan(of_commands.margins["friction"]).all()
