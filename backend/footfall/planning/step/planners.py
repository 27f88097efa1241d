"""The planners by name: each takes the leg from one lifted posture to another through the air."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from footfall.core.arrays import Array
from footfall.planning.scene.lift import leaned
from footfall.planning.step.search import with_ompl
from footfall.planning.step.search.astar import astar
from footfall.planning.step.search.edges import Space
from footfall.planning.step.search.fast import fast
from footfall.planning.step.search.line import line
from footfall.planning.step.situation import Situation
from footfall.robot.ik import solve_leg

_Found = TypeVar("_Found")


@dataclass(frozen=True)
class SwingProblem:
    """From start to goal: leg postures (6,) over the two footfalls, both free."""

    situation: Situation
    space: Space
    start: Array
    goal: Array


@dataclass(frozen=True)
class PlannerAnswer:
    """path: waypoints (n, 6), or None and then ``why()`` says why; short: whether it is shortened already."""

    path: Array | None
    why: Callable[[], str] = lambda: ""
    short: bool = False


def _line(swing: SwingProblem) -> PlannerAnswer:
    path = line(swing.space, swing.start, swing.goal)
    if path is not None:
        return PlannerAnswer(path)
    return PlannerAnswer(None, lambda: _blocked_line(swing))


def _blocked_line(swing: SwingProblem) -> str:
    t = swing.space.first_blocked(swing.start, swing.goal) or 0.0
    why = swing.situation.objection(swing.start + t * (swing.goal - swing.start), "raised")
    return f"the straight swing is blocked after {t:.0%}: {why}"


def _astar(swing: SwingProblem) -> PlannerAnswer:
    situation, settings = swing.situation, swing.situation.settings
    T_start, T_goal = situation.wheel(swing.start), situation.wheel(swing.goal)
    p_start, p_goal = T_start[:3, 3], T_goal[:3, 3]
    across = p_goal - p_start
    turn = Rotation.from_matrix(T_start[:3, :3].T @ T_goal[:3, :3]).as_rotvec()

    def postures(points: Array) -> Array:
        # the wheel turns from the start's to the goal's orientation on its way, in the plane of the leg, where
        # neighbouring postures are close even with a straight wrist
        share = np.clip((points - p_start) @ across / max(float(across @ across), 1e-12), 0.0, 1.0)
        Ts = np.zeros((len(points), 4, 4))
        Ts[:, :3, :3] = T_start[:3, :3] @ Rotation.from_rotvec(share[:, None] * turn).as_matrix()
        Ts[:, :3, 3], Ts[:, 3, 3] = points, 1.0
        Ts = leaned(situation.robot, situation.leg, Ts, np.ones(len(Ts)))
        solved = solve_leg(situation.robot, situation.leg, Ts)
        return np.where(solved.valid[..., None], solved.q, np.nan)

    path = astar(swing.space, postures, (p_start, swing.start), (p_goal, swing.goal), settings.cell)
    return PlannerAnswer(path, lambda: f"no free path on A*'s {settings.cell:z.2f} m grid")


def _fast(swing: SwingProblem) -> PlannerAnswer:
    found = _searched(swing, partial(fast, certificate=swing.situation.footing.certificate))
    return PlannerAnswer(None, lambda: found) if isinstance(found, str) else PlannerAnswer(found, short=True)


def _sbl(swing: SwingProblem) -> PlannerAnswer:
    path = _searched(swing, with_ompl.sbl)
    placed = swing.situation.settings.milestones
    return PlannerAnswer(path, lambda: f"SBL placed {placed} milestones without joining them")


def _by_ompl(search: Callable[..., Array | None], name: str, swing: SwingProblem) -> PlannerAnswer:
    path = _searched(swing, search)
    made = swing.situation.settings.milestones
    return PlannerAnswer(path, lambda: f"{name} found no path in {made} iterations")


def _searched(swing: SwingProblem, search: Callable[..., _Found]) -> _Found:
    """A sampling search with what the settings say of it."""
    settings = swing.situation.settings
    return search(
        swing.space,
        start=swing.start,
        goal=swing.goal,
        radius=settings.radius,
        milestones=settings.milestones,
        seed=settings.seed,
    )


REGISTRY: dict[str, Callable[[SwingProblem], PlannerAnswer]] = {
    "line": _line,
    "fast": _fast,
    "astar": _astar,
    "sbl": _sbl,
    "rrtconnect": partial(_by_ompl, with_ompl.rrtconnect, "RRTConnect"),
    "kpiece": partial(_by_ompl, with_ompl.kpiece, "KPIECE1"),
    "bitstar": partial(_by_ompl, with_ompl.bitstar, "BIT*"),
}
