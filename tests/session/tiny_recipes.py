"""Recipes for tests: quick, and some that misbehave. Worker processes import this module by name."""

import logging
import os
import time

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.progress import preview_of
from footfall.core.value import Provenance
from footfall.maps.layers import MapStack
from footfall.planning.answers import Status
from footfall.planning.body.body_shift import PredictedState
from footfall.planning.step.problem import PlanResult, StepPlan
from footfall.session.jobs.product_recipes import edit, export, sequence
from footfall.terrain.dem import Dem

COARSE = GridGeometry(-4.0, -4.0, 4.0, 2, 2)


def dem(height=0.0):
    return Dem(
        np.full((8, 8), height, np.float32),
        GridGeometry(-4.0, -4.0, 1.0, 8, 8),
        "flat",
        Provenance({"height": str(height)}),
    )


def terrain(parents, settings, progress):
    progress(0.5, "half")
    return dem(0.25)


def maps(parents, settings, progress):
    ground = parents["dem"]

    def stack(grid):
        return MapStack(
            grid,
            settings.leg,
            "plain",
            {"footing": np.full(grid.shape, 3, np.uint8), "margin": np.full(grid.shape, 0.2, np.float32)},
            Provenance({name: value.digest for name, value in parents.items()}, settings.settings),
        )

    preview_of(progress)(stack(COARSE))
    if ground.name == "slow":
        for i in range(2000):
            progress(i / 2000, "slowly")
            time.sleep(0.01)
    if ground.name == "bad":
        raise InvalidInput("this ground can't be mapped")
    return stack(ground.geometry)


def plan(parents, settings, progress):
    state, chosen = parents["state"], settings.footfall
    if parents["dem"].name == "slow":
        progress(0.5, "planning slowly")
        time.sleep(60)
    provenance = Provenance({name: value.digest for name, value in parents.items()}, settings.settings)
    if settings.settings.branch is not None:
        return PlanResult(Status.GOAL_INVALID, None, "not with that knee", (), chosen, provenance)
    if settings.settings.planner == "line" and chosen.x > 3:
        return PlanResult(Status.TIME_LIMIT, None, "too long", (), chosen, provenance)
    if chosen.x > 2:
        return PlanResult(Status.GOAL_INVALID, None, "the leg can't reach it", (), chosen, provenance)
    waypoints = np.repeat(state.posture[None], 4, axis=0)
    waypoints[1:, 6 * chosen.leg] += np.array([0.05, 0.1, 0.15])
    made = StepPlan(
        chosen.leg,
        waypoints,
        ("lift", "lift", "swing", "lower"),
        state.T_site_base,
        np.array([chosen.x, chosen.y, 0.0]),
        np.array([0.0, 0.0, 1.0]),
        0,
        "line",
        provenance,
    )
    return PlanResult(Status.FOUND, made, "", (), chosen, provenance)


def after(parents, settings, progress):
    state, ended = parents["state"], parents.get("plan") or parents["sequence"]
    provenance = Provenance({**{name: value.digest for name, value in parents.items()}, "after": ended.digest})
    posture = ended.plan.waypoints[-1] if "plan" in parents else ended.predicted[-1]
    return PredictedState(
        state.robot,
        state.time,
        posture,
        state.T_site_base,
        state.wheel_forces,
        state.joint_torques,
        "idle",
        ("posture",),
        provenance,
    )


def flat_sequence(parents, settings, progress):
    return sequence({**parents, "dem": None}, settings, progress)


def flat_edit(parents, settings, progress):
    return edit({**parents, "dem": None}, settings, progress)


def quick(parents, settings, progress):
    return parents["dem"]


def raises(parents, settings, progress):
    raise InvalidInput("this is wrong", what=3)


def breaks(parents, settings, progress):
    raise ZeroDivisionError("a bug")


def polite(parents, settings, progress):
    while True:
        progress(0.5, "running")
        time.sleep(0.01)


def deaf(parents, settings, progress):
    progress(0.5, "deaf")
    time.sleep(60)


def dies(parents, settings, progress):
    progress(0.1, "about to die")
    os._exit(7)


def pid(parents, settings, progress):
    return str(os.getpid()).encode()


def logs(parents, settings, progress):
    logging.getLogger("footfall.tiny").warning("the ground is %s", "soft", extra={"where": 3})
    try:
        raise ZeroDivisionError("a bug")
    except ZeroDivisionError:
        logging.getLogger("a.library").exception("it broke")
    logging.getLogger("a.library").debug("unheard")
    return b"x"


RECIPES = {
    "terrain": terrain,
    "maps": maps,
    "plan": plan,
    "after": after,
    "sequence": flat_sequence,
    "edit": flat_edit,
    "export": export,
    "quick": quick,
    "raises": raises,
    "breaks": breaks,
    "polite": polite,
    "deaf": deaf,
    "dies": dies,
    "pid": pid,
    "logs": logs,
}
