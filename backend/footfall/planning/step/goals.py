"""How the leg may stand at the goal: postures on the contact, best first, each with its free way up."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.maps.standing import SAME_PLACE, contacts
from footfall.planning.scene.ground import Contact
from footfall.planning.scene.lift import branch_of, vertical
from footfall.planning.scene.unreached import unreached
from footfall.planning.step.footing import LegStance
from footfall.planning.step.held import unheld
from footfall.planning.step.problem import Decision
from footfall.planning.step.rise import blocked_rise, rises, space_of
from footfall.planning.step.situation import TRUE, Situation
from footfall.planning.step.target import Candidate, candidates, upright_poses
from footfall.planning.watch import Watch
from footfall.robot.leg_branches import bend_of, bend_text, branch_number

MOST_GOALS = 3
"""Goal postures whose lowering works that are handed to the planners, best first."""
ALIKE = 1e-3
"""Postures whose clearances are in the same step of this size rank by their motion [m]."""
MOST_NAMED = 3
"""Postures that rank better than the one taken whose fault is told."""
ADVICE = "choose a footfall nearer to the leg's present one or on more open ground, or lower raise_terrain or clearance"


@dataclass(frozen=True)
class Goal:
    """A goal posture that the wheel can be lowered to. place: its rank, 0 best; up: (n, 6) from it to above it."""

    place: int
    candidate: Candidate
    up: Array


class Goals:
    """Up to MOST_GOALS goals, best first, each worked out when it is first asked for.

    refusal: why there is none, with what to try; empty where there is one.
    """

    def __init__(self, situation: Situation, watch: Watch, stance: LegStance, contact: Contact, q_start: Array) -> None:
        self._situation, self._watch = situation, watch
        self._found: list[Goal] = []
        self._contact = contact
        branch, asked = branch_of(situation.robot, situation.leg, q_start), situation.settings.branch
        everyone = candidates(situation.robot, situation.leg, contact, situation.T_site_base, q_start, branch)
        self._q_start = q_start
        by_motion = [one for one in everyone if asked is None or bend_of(one.branch) == bend_of(asked)]
        self._possible = by_motion
        self._spare: list[float] = []
        if situation.settings.goals == "clearance":
            self._rank_by_clearance()
        self._rest = self._worked_out()
        self.refusal = self._unreachable(stance, contact, everyone) if not self._possible else ""
        if not self.refusal and next(iter(self), None) is None:
            x, y, _ = contact.point
            self.refusal = (
                f"leg {situation.leg} can't stand at ({x:z.2f}, {y:z.2f}): none of {len(self._possible)} postures that "
                f"reach it is allowed; in the nearest, {self._objection(by_motion[0])}; {ADVICE}"
            )

    def __iter__(self) -> Iterator[Goal]:
        yield from self._found
        for goal in self._rest:
            self._found.append(goal)
            yield goal

    def decisions(self, taken: Goal) -> list[Decision]:
        """The better postures that were refused, why, and the posture that was taken, with how it ranks.

        Those that were refused for their own sake are told; those that no planner led to are the planners' to tell.
        """
        count, handed = len(self._possible), {goal.place for goal in self._found}
        refused = [place for place in range(taken.place) if place not in handed]
        found = []
        for place in refused[:MOST_NAMED]:
            one = self._possible[place]
            text = f"rank {place + 1}, {posture_text(one)}, is not allowed: {self._objection(one)}"
            found.append(Decision("goal", False, text))
        if len(refused) > MOST_NAMED:
            more = len(refused) - MOST_NAMED
            found.append(Decision("goal", False, f"{more} more of better rank are not allowed either"))
        one = taken.candidate
        away = float(np.abs(one.q - self._q_start).max())
        by = " by clearance" if self._spare else ""
        text = f"rank {taken.place + 1}{by} of {count} postures that reach the footfall: {posture_text(one)}, "
        if self._spare:
            text += f"{1e3 * self._spare[taken.place]:z.0f} mm to spare beyond every clearance, "
        return [*found, Decision("goal", True, text + f"{away:z.2f} rad from the start in the joint that turns most")]

    def _rank_by_clearance(self) -> None:
        """Most room first; of those alike in that, by motion as before."""
        spare = []
        for one in self._possible:
            self._watch.tick()
            spare.append(self._situation.spare(one.q))
        order = np.argsort(-np.floor(np.array(spare) / ALIKE), kind="stable")
        self._possible = [self._possible[i] for i in order]
        self._spare = [spare[i] for i in order]

    def _worked_out(self) -> Iterator[Goal]:
        situation, found = self._situation, 0
        space = space_of(situation, self._watch, TRUE)
        for place, candidate in enumerate(self._possible):
            self._watch.tick()
            if not space.is_free(candidate.q) or self._elsewhere(candidate) > SAME_PLACE:
                continue
            up = self._way_up(candidate)
            if not isinstance(up, str) and rises(situation, self._watch, up) and not self._unheld(up):
                found += 1
                yield Goal(place, candidate, up)
                if found == MOST_GOALS:
                    return

    def _elsewhere(self, candidate: Candidate) -> float:
        """How far from the footfall the wheel would be taken to touch once it stands there, leaning [m]."""
        if candidate.lean == 0:
            return 0.0
        situation = self._situation
        posture, leg = situation.posture(candidate.q), situation.leg
        found = contacts(situation.robot, situation.stance.dem, posture, situation.T_site_base, [leg]).points[0]
        return float(np.linalg.norm(found - self._contact.point))

    def _way_up(self, candidate: Candidate) -> Array | str:
        situation = self._situation
        return vertical(situation.robot, situation.leg, situation.T_site_base, candidate.q, situation.settings.lift)

    def _objection(self, candidate: Candidate) -> str:
        """What forbids a goal posture or its way up."""
        objection = self._situation.objection(candidate.q, TRUE)
        if objection:
            return objection
        away = self._elsewhere(candidate)
        if away > SAME_PLACE:
            return f"leaning, the wheel would touch the ground {away:z.3f} m from there, at an edge"
        up = self._way_up(candidate)
        if isinstance(up, str):
            return f"the wheel can't be lowered: {up}"
        unheld = self._unheld(up)
        return f"with the leg above it {unheld}" if unheld else blocked_rise(self._situation, self._watch, up)

    def _unheld(self, up: Array) -> str:
        """What the other legs lack while the wheel is lowered."""
        return unheld(self._situation.stance, self._situation.settings.friction, up)

    def _unreachable(self, stance: LegStance, contact: Contact, everyone: list[Candidate]) -> str:
        leg, (x, y, _) = self._situation.leg, contact.point
        asked = self._situation.settings.branch
        if everyone and asked is not None:
            bends = sorted({bend_of(one.branch) for one in everyone})
            others = " or ".join(bend_text(branch_number(bend, 0)) for bend in bends)
            return (
                f"leg {leg} can't stand at ({x:z.2f}, {y:z.2f}) with {bend_text(asked)}, only with "
                f"{others}; ask for that branch, or leave it open"
            )
        away, reach = float(np.linalg.norm(contact.point - stance.hip)), stance.reach
        advice = "choose a footfall that the reach map shows green"
        if away > reach:
            there, farthest = beside(away, reach, 2)
            return (
                f"leg {leg} can't stand at ({x:z.2f}, {y:z.2f}): it is {there} m from its hip, farther than the "
                f"{farthest} m it can reach; no joint angles inside the limits put the wheel upright there; {advice}"
            )
        poses = upright_poses(self._situation.robot, leg, contact, self._situation.T_site_base)
        what = unreached(self._situation.robot, leg, poses)
        return f"leg {leg} can't stand upright at ({x:z.2f}, {y:z.2f}), {away:z.2f} m from its hip: {what}; {advice}"


def posture_text(one: Candidate) -> str:
    """A goal posture in words: branch, heading and lean of the wheel."""
    lean = f", leaning {np.rad2deg(one.lean):z.1f}°" if one.lean > 0 else ""
    return f"{bend_text(one.branch)}, wheel turned {np.rad2deg(one.turn):+z.0f}° from the leg's radial direction{lean}"
