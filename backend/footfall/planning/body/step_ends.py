"""Whether a step could begin and end from a stance: the leg lifted straight up, and lowered onto the footfall.

These are the step planner's own demands on start and goal (see planning/step/plan.py), asked of a whole-body scene
that is built once for all chassis poses. What lies between, the swing, is for the step planner.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from footfall.balance.support import margins
from footfall.balance.torques import torque_margin
from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.planning.body.body_move import StandingRover
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.move_checks import coms_of
from footfall.planning.joint_path import samples
from footfall.planning.scene.ground import Contact
from footfall.planning.scene.lift import branch_of, vertical
from footfall.planning.scene.unreached import unreached
from footfall.planning.step.held import NOTHING_HOLDS
from footfall.planning.step.target import HEADINGS, candidates, upright_poses
from footfall.robot.description import PARTS, link_name
from footfall.robot.ik import wheel_pose_for_contact

SAMPLING = 0.02
"""Largest change of a joint between two looks at a lift [rad]."""
MOST_POSTURES = 8
"""Goal postures looked at, best first."""


@dataclass(frozen=True)
class StepEnds:
    """One leg that is to step onto ``contact`` while all other wheels stand."""

    stance: StandingRover
    leg: int
    contact: Contact
    settings: FindShiftSettings

    def objection(self, posture: Array, T_site_base: Array) -> str:
        """What prevents the step's start or goal with the chassis there; empty where nothing does.

        posture: (legs × 6,) [rad]; T_site_base: (4, 4).
        """
        robot, lift = self.stance.robot, self.settings.lift
        q = posture[6 * self.leg : 6 * self.leg + 6]
        up = vertical(robot, self.leg, T_site_base, q, lift)
        if isinstance(up, str):
            return f"leg {self.leg} can't be lifted {lift:z.2f} m: {up}"
        blocked = self._blocked(posture, T_site_base, up)
        if blocked:
            return f"leg {self.leg} can't be lifted {lift:z.2f} m: {blocked}"
        first = ""
        possible = candidates(robot, self.leg, self.contact, T_site_base, q, branch_of(robot, self.leg, q))
        for goal in possible[:MOST_POSTURES]:
            up = vertical(robot, self.leg, T_site_base, goal.q, lift)
            blocked = up if isinstance(up, str) else self._blocked(posture, T_site_base, up)
            if not blocked:
                return ""
            first = first or blocked
        if not possible:
            what = unreached(robot, self.leg, upright_poses(robot, self.leg, self.contact, T_site_base))
            return f"leg {self.leg} can't stand upright on the footfall: {what}"
        return f"leg {self.leg} can't be lowered onto the footfall: {first}"

    def rough(self) -> str:
        """Why the wheel can't stand upright on the footfall at any heading, wherever the chassis is; or empty."""
        body, wheel = self.stance.body, link_name(self.leg, "wheel")
        headings = np.linspace(0.0, np.pi, len(HEADINGS), endpoint=False)
        Ts_site_wheel = wheel_pose_for_contact(
            self.stance.robot, self.contact.point, self.contact.normal, headings, np.eye(4)
        )
        for T_site_wheel in Ts_site_wheel:
            Ts = np.tile(np.eye(4), (1, len(body.links), 1, 1))
            Ts[0, body.links.index(wheel)] = T_site_wheel
            near = body.ground_gap(Ts, [wheel], touching=(self.leg,)).gap
            if near.spare >= 0:
                return ""
        sink = self.stance.robot.description.clearances.wheel_sink
        return (
            f"the ground around the footfall is too rough: at every heading an upright wheel would cut more than the "
            f"allowed {sink:z.3f} m into it"
        )

    def _blocked(self, posture: Array, T_site_base: Array, up: Array) -> str:
        """What forbids a vertical move from the ground up, (n, 6); empty where nothing does."""
        settings, robot, body = self.settings, self.stance.robot, self.stance.body
        legs = np.concatenate([[q for _, q in samples(a, b, SAMPLING)] for a, b in itertools.pairwise(up)])
        postures = np.tile(posture, (len(legs), 1))
        postures[:, 6 * self.leg : 6 * self.leg + 6] = legs
        coms = apply(T_site_base, coms_of(robot, posture, postures))
        others = [i for i, leg in enumerate(self.stance.standing) if leg != self.leg]
        spare = margins(self.stance.feet.points[others], coms[:, :2], settings.conservative).min()
        if spare < settings.least_margin:
            kept, wanted = beside(float(spare), settings.least_margin)
            return f"the margin to the other feet's polygon is {kept} m, {wanted} m is wanted"
        Ts_base_link = body.poses(postures)
        links = [link_name(self.leg, part) for part in PARTS]
        near = body.own_gap(Ts_base_link, links).gap
        if near.spare < 0:
            return f"{near.between} come {-near.spare:z.3f} m too near to each other"
        Ts_site_link = T_site_base @ Ts_base_link
        near = body.ground_gap(Ts_site_link, links, touching=(self.leg,)).gap
        if near.spare < 0:
            return f"{near.between} come {-near.spare:z.3f} m too near to each other"
        near = body.ground_gap(Ts_site_link[-1:], links, settings.raise_terrain).gap
        if near.spare < 0:
            raised = f"raised by {settings.raise_terrain:z.2f} m"
            return f"{near.between} {raised} come {-near.spare:z.3f} m too near to each other"
        standing = [self.stance.standing[i] for i in others]
        normals = self.stance.feet.normals[others]
        for at in (0, -1):
            held = torque_margin(robot, postures[at], T_site_base, standing, normals, settings.friction)
            if not held.holds:
                needed = beside(held.ratio, 1.0, 2)[0]
                return f"{held.joint_name} would need {needed} of its torque limit" if held.feasible else NOTHING_HOLDS
        return ""
