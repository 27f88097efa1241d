"""A walk as the plans that there are already: for each foot move a move of the chassis, then a step."""

from collections.abc import Iterator

import numpy as np

from footfall.core.errors import InvalidInput
from footfall.core.value import Provenance
from footfall.planning.body.body_shift import BodyShift
from footfall.planning.body.move import BodyMovePlan, BodyMoveSettings
from footfall.planning.motion import BODY, Motion
from footfall.planning.step.problem import StepPlan, StepSettings
from footfall.planning.walk.problem import WalkPlan, WalkSettings

PLANNER = "walk"
"""What planned the step of a foot move."""


def parts_of(plan: WalkPlan) -> tuple[BodyMovePlan | StepPlan, ...]:
    """The moves of the chassis and the steps of a walk, in order; each starts where the one before ends.

    A move of the chassis that goes nowhere is left out. Parents are the walk, and what it was planned from but its
    state, where only the first starts. Settings are the walk's, as a move or a step has them. Raises InvalidInput where
    a foot move lifts nothing.
    """
    return tuple(_parts(plan))


def stay(plan: WalkPlan, number: int) -> BodyMovePlan:
    """A move of the chassis from where the step of foot move ``number`` begins to there: forces shift, nothing else."""
    parents, settings = _given(plan)
    moving = (plan.moves == number) & np.array([phase != BODY for phase in plan.phases])
    before = int(np.flatnonzero(moving)[0]) - 1
    return _body_move(plan, number, plan.motion.rows([before, before]), parents, settings)


def _given(plan: WalkPlan) -> tuple[dict[str, str], WalkSettings]:
    """Parents and settings of the parts."""
    parents = {name: digest for name, digest in plan.parents.items() if name != "state"} | {"walk": plan.digest}
    asked = plan.provenance.settings
    return parents, asked if isinstance(asked, WalkSettings) else WalkSettings()


def _parts(plan: WalkPlan) -> Iterator[BodyMovePlan | StepPlan]:
    parents, settings = _given(plan)
    motion = plan.motion
    in_body = np.array([phase == BODY for phase in motion.phases])
    at = 0
    for number in range(plan.foot_moves + 1):
        own = np.flatnonzero(plan.moves == number)
        shifted, stepped = own[in_body[own]], own[~in_body[own]]
        ends = int(shifted[-1]) if len(shifted) else at
        if ends > at:
            yield _body_move(plan, number, motion.rows(range(at, ends + 1)), parents, settings)
        at = ends
        if number == plan.foot_moves:
            return
        if not len(stepped):
            raise InvalidInput(f"foot move {number} of the walk lifts no foot", move=number)
        yield _step(plan, number, motion.rows(range(at, int(stepped[-1]) + 1)), parents, settings)
        at = int(stepped[-1])


def _body_move(
    plan: WalkPlan, number: int, motion: Motion, parents: dict[str, str], settings: WalkSettings
) -> BodyMovePlan:
    """The move of the chassis before foot move ``number``, or after the last."""
    poses, contacts = motion.Ts_site_base, plan.stances[number].contacts
    made_with = BodyMoveSettings(
        clearance=settings.clearance,
        conservative=settings.support == "required",
        least_margin=settings.least_margin,
        friction=settings.friction,
        time_limit=settings.time_limit,
        reach_reserve=settings.reach_reserve,
        joint_reserve=settings.joint_reserve,
    )
    return BodyMovePlan(
        shift=BodyShift.between(poses[0], poses[-1]),
        waypoints=motion.waypoints,
        Ts_site_base=poses,
        standing=tuple(range(len(contacts))),
        contacts=contacts,
        provenance=Provenance(parents, made_with, settings.seed),
    )


def _step(plan: WalkPlan, number: int, motion: Motion, parents: dict[str, str], settings: WalkSettings) -> StepPlan:
    """The step of foot move ``number``."""
    leg, placed = plan.legs[number], plan.stances[number + 1]
    made_with = StepSettings(
        lift=settings.lift,
        raise_terrain=settings.raise_terrain,
        clearance=settings.clearance,
        conservative=settings.support == "required",
        least_margin=settings.least_margin,
        friction=settings.friction,
        seed=settings.seed,
        time_limit=settings.time_limit,
        steep_ground=False,
    )
    return StepPlan(
        leg=leg,
        waypoints=motion.waypoints,
        phases=(motion.phases[1], *motion.phases[1:]),
        T_site_base=motion.Ts_site_base[0],
        contact=placed.contacts[leg],
        normal=placed.normals[leg],
        branch=int(placed.branches[leg]),
        planner=PLANNER,
        provenance=Provenance(parents, made_with, settings.seed),
    )
