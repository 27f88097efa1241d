"""Footfalls of a walk: one for each foot move, on the ground, where the walk says that its feet end."""

from dataclasses import replace

import numpy as np

from footfall.planning.any_robot import plan_walk, stand
from footfall.planning.legged.footfalls import footfalls
from footfall.planning.legged.problem import LeggedPlan, LeggedSettings
from footfall.terrain.generate import slope
from footfall.terrain.ground.surface import height_at
from tests.support.described import robot_of

UNHURRIED = LeggedSettings(time_limit=1e6)


def test_footfalls_are_where_the_feet_end():
    _, robot = robot_of(6)
    dem = slope(4.0, 0.1, 0.1, 0.7)
    result = plan_walk(robot, dem, stand(robot, dem, settings=UNHURRIED), (0.08, 0.0), settings=UNHURRIED)
    plan = result.plan
    assert isinstance(plan, LeggedPlan), result.reason
    found = footfalls(robot, plan)
    assert tuple(one.leg for one in found) == plan.moves
    assert [one.row for one in found] == sorted({one.row for one in found})
    for one in found:
        # a ball on a slope touches it beside its lowest point, which then lies over the ground by r (1/cos − 1)
        over = one.point[2] - height_at(dem, *one.point[:2])
        assert over + 1e-6 >= 0.0
        assert over <= robot.radii[one.leg] * (1 / np.cos(0.1) - 1) + 2e-3
    last = {one.leg: one.point for one in found}
    for leg, point in last.items():
        sole = plan.end.soles[leg] - [0.0, 0.0, robot.radii[leg]]
        np.testing.assert_allclose(point, sole, atol=robot.radii[leg] / 2, err_msg="but for how far it rolled since")
    cut = replace(
        plan,
        waypoints=plan.waypoints[: found[1].row],
        Ts_site_base=plan.Ts_site_base[: found[1].row],
        phases=plan.phases[: found[1].row],
        legs=plan.legs[: found[1].row],
    )
    # a foot that was not put down yet, or is still on its way down, is no footfall
    assert [one.leg for one in footfalls(robot, cut) if one.row <= found[0].row] == [found[0].leg]
