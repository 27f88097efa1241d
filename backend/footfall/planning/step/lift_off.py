"""Whether a leg can be lifted from where it stands: what the start of a step alone decides, whatever the footfall."""

from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.planning.answers import No, Status
from footfall.planning.scene.lift import vertical
from footfall.planning.step.escape import find_escape
from footfall.planning.step.footing import LegStance, ground_near, impossible
from footfall.planning.step.held import unheld_lift
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.rise import blocked_rise, rises
from footfall.planning.step.search.fast import compile_search
from footfall.planning.step.situation import TRUE, Situation
from footfall.planning.watch import Watch

ADVICE = "change the stance, or ask for another lift, raise_terrain, clearance or margin"


@dataclass(frozen=True)
class Lifted:
    """up: postures of the leg (n, 6) from where it stands to straight above."""

    situation: Situation
    up: Array


def lift_off(stance: LegStance, settings: StepSettings, watch: Watch, to_plan: bool = True) -> Lifted | No:
    """The leg straight up from where it stands, or what forbids it; what is quickly found first.

    to_plan: a search is to follow, so it is compiled; and a start that collides says the smallest ways out.
    """
    objection = impossible(stance)
    if objection:
        return No(Status.START_INVALID, f"the rover can't stand as its state says: {objection}")
    robot, state, leg, lift = stance.robot, stance.state, stance.leg, settings.lift
    q = np.array(state.leg(leg))
    up = vertical(robot, leg, np.asarray(state.T_site_base), q, lift)
    unheld = unheld_lift(stance, settings.friction, q[None] if isinstance(up, str) else up)
    if unheld:
        return No(Status.START_INVALID, unheld[0], (unheld[1],))
    ground = ground_near(stance)
    if isinstance(ground, No):
        return ground
    watch.phase(0.05, "building the collision scene")
    with watch.uncounted():
        situation = Situation(robot, stance.dem, state, leg, ground, settings)
        situation.first_unsure(situation.lower[None], TRUE)
        if to_plan:
            compile_search(situation.footing.certificate)
    objection = situation.objection(q, TRUE)
    if objection:
        ways = find_escape(situation, q, watch.pulse).in_words(robot, leg) if to_plan else ""
        advice = f"the smallest way out found: {ways}; else " if ways else ""
        advice += "correct the state or the terrain, move the chassis, or ask for less clearance or margin"
        reason = f"the leg can't move from where it stands: {objection}; {advice}"
        return No(Status.START_INVALID, reason)
    if isinstance(up, str):
        reason = f"the wheel can't be lifted {lift:z.2f} m straight up: {up}; lower lift or change the stance"
        return No(Status.NO_PATH, reason)
    if not rises(situation, watch, up):
        blocked = blocked_rise(situation, watch, up)
        return No(Status.NO_PATH, f"the wheel can't be lifted {lift:z.2f} m straight up: {blocked}; {ADVICE}")
    return Lifted(situation, up)
