"""Whether a problem has a solution: a long search by other means than the planners that are measured.

Every goal posture is tried, not the best few; OMPL's RRTConnect and KPIECE1 run from many seeds, in several ranges and
without smoothing; what they find counts only if the recheck of whole paths accepts it.
"""

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.steps.problem import Scene, StepProblem
from footfall.core.arrays import Array
from footfall.planning.joint_path import samples
from footfall.planning.scene.ground import Contact, Nearby, footfall_contact
from footfall.planning.scene.lift import branch_of, vertical
from footfall.planning.step.footing import LegStance, ground_near, impossible
from footfall.planning.step.problem import StepSettings
from footfall.planning.step.search import with_ompl
from footfall.planning.step.search.edges import Space
from footfall.planning.step.search.fast import escaped, searched
from footfall.planning.step.situation import NO_GROUND, RAISED, TRUE, Situation
from footfall.planning.step.target import candidates
from footfall.planning.step.verify import recheck
from footfall.robot.meshes.collision import CollisionScene

WAYS: tuple[tuple[Callable[..., Array | None], float], ...] = (
    (with_ompl.rrtconnect, 0.6),
    (with_ompl.rrtconnect, 0.25),
    (with_ompl.rrtconnect, 1.2),
    (with_ompl.kpiece, 0.6),
)
"""Searches, in turn, and the largest extension of their trees [rad]."""
ITERATIONS = 3000
"""Of one run, before the next goal, seed and range."""
_NEAREST = 3
"""Goals that a straight swing is tried to, as many as planning hands to its planners."""
_NEAR = 0.1
"""[m]"""
_CHECKED = 0.01
"""Largest change of a joint between checked postures of lift and lower [rad]."""


@dataclass(frozen=True)
class Posed:
    """A problem that is one: the leg can be lifted, and lowered onto at least one goal.

    up: (n, 6) the lift; downs: for each goal its way up, (m, 6) each, nearest goal first.
    """

    scene: Scene
    leg: int
    situation: Situation
    contact: Contact
    up: Array
    downs: tuple[Array, ...]

    def space(self, terrain: str) -> Space:
        return _space(self.situation, terrain)

    @property
    def line_is_free(self) -> bool:
        """Whether a straight swing is free to any of the goals that planning considers."""
        return any(self.space(RAISED).edge_is_free(self.up[-1], down[-1]) for down in self.downs[:_NEAREST])

    @property
    def a_leg_is_near(self) -> bool:
        """Whether at the nearest goal, or above it, another leg is nearer than ``_NEAR`` beyond its δ."""
        state = self.scene.state
        scene = CollisionScene(self.scene.robot, state.posture, self.leg, state.T_site_base, None, _NEAR)
        hits = scene.contacts(self.downs[0][0], NO_GROUND) + scene.contacts(self.downs[0][-1], NO_GROUND)
        own = f"leg{self.leg}_"
        return any(hit.link_b.startswith("leg") and not hit.link_b.startswith(own) for hit in hits)


def pose(problem: StepProblem, scene: Scene) -> Posed | str:
    """The problem with its start and goals, or why it is none."""
    robot, dem, state, leg = scene.robot, scene.dem, scene.state, problem.leg
    contact = footfall_contact(robot, dem, *problem.target)
    if not isinstance(contact, Contact):
        return contact.reason
    stance = LegStance(robot, dem, state, leg)
    objection = impossible(stance)
    if objection:
        return objection
    situation = situation_of(problem, scene)
    q = np.array(state.leg(leg))
    up = vertical(robot, leg, situation.T_site_base, q, situation.settings.lift)
    if isinstance(up, str) or not _passes(situation, up):
        return "the wheel can't be lifted"
    downs = []
    for one in candidates(robot, leg, contact, situation.T_site_base, up[-1], branch_of(robot, leg, up[-1])):
        way = vertical(robot, leg, situation.T_site_base, one.q, situation.settings.lift)
        if not isinstance(way, str) and _passes(situation, way):
            downs.append(way)
    if not downs:
        return "the leg can't stand at the target or be lowered onto it"
    return Posed(scene, leg, situation, contact, up, tuple(downs))


def situation_of(problem: StepProblem, scene: Scene) -> Situation:
    """The tests of the moving leg's postures, with the usual settings. Raises RuntimeError where no ground is known."""
    ground = ground_near(LegStance(scene.robot, scene.dem, scene.state, problem.leg))
    if not isinstance(ground, Nearby):
        raise RuntimeError(f"{problem.name}: {ground.reason}")
    return Situation(scene.robot, scene.dem, scene.state, problem.leg, ground, StepSettings())


def unsure_ends(situation: Situation, start: Array, goal: Array) -> int:
    """How many ends of a swing are free, but too near to something for the compiled check."""
    return sum(situation.first_unsure(q[None], RAISED) == 0 for q in (start, goal))


def raw_search(situation: Situation, start: Array, goal: Array, seed: int) -> float | None:
    """Seconds of processor time of our compiled search alone, or None if it found nothing.

    It runs between sure postures; where an end is unsure, the look for one beside it, over meshes, is timed too.
    """
    settings, certificate = situation.settings, situation.footing.certificate
    space, rng = _space(situation, RAISED), np.random.default_rng(seed)
    unsure = unsure_ends(situation, start, goal)
    begin = time.process_time()
    if unsure:
        first, last = escaped(space, start, rng), escaped(space, goal, rng)
        if first is None or last is None:
            return None
        start, goal = first, last
    trees = searched(space, certificate, start, goal, rng, settings.radius, settings.milestones)
    return None if trees is None else time.process_time() - begin


def solved(posed: Posed, limit: float) -> str | None:
    """By what a certified motion was found within ``limit`` [s of processor time], or None."""
    end = time.process_time() + limit
    for seed, (search, radius) in itertools.product(range(1000, 2000), WAYS):
        for number, down in enumerate(posed.downs):
            if time.process_time() > end:
                return None
            path = search(posed.space(RAISED), posed.up[-1], down[-1], radius=radius, milestones=ITERATIONS, seed=seed)
            if path is not None and _holds(posed, path, down):
                return f"{search.__name__} goal {number} of {len(posed.downs)} range {radius:g} seed {seed}"
    return None


def _holds(posed: Posed, path: Array, down: Array) -> bool:
    q = np.concatenate([posed.up, path[1:], down[::-1][1:]])
    phases = ("lift",) * len(posed.up) + ("swing",) * (len(path) - 1) + ("lower",) * (len(down) - 1)
    waypoints = np.tile(np.asarray(posed.scene.state.posture), (len(q), 1))
    waypoints[:, 6 * posed.leg : 6 * posed.leg + 6] = q
    return all(check.holds for check in recheck(posed.situation, posed.scene.dem, waypoints, phases))


def _space(situation: Situation, terrain: str) -> Space:
    return Space(
        situation.lower,
        situation.upper,
        lambda q: situation.free(q, terrain),
        situation.settings.epsilon,
        first_unsure=lambda qs: situation.first_unsure(qs, terrain),
    )


def _passes(situation: Situation, up: Array) -> bool:
    """Whether a vertical move is free over the ground, and its upper end over the raised ground."""
    return situation.free(up[-1], RAISED) and all(
        situation.free(q, TRUE) for a, b in itertools.pairwise(up) for _, q in samples(a, b, _CHECKED)
    )
