"""One leg about to move: what is frozen, and which postures of the leg are allowed.

The compiled certificate is asked first; where it is unsure the meshes decide, so the answers are those of the meshes.
"""

from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from footfall.core.arrays import Array
from footfall.core.beside import beside
from footfall.core.frames import apply
from footfall.planning.scene.collision_depth import in_words, worst
from footfall.planning.scene.ground import Nearby
from footfall.planning.step.footing import LegStance, footing
from footfall.planning.step.problem import StepSettings
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import center_of_mass, leg_wheel_pose
from footfall.robot.limits import farthest_past
from footfall.robot.meshes.collision import TERRAIN, Collision, CollisionScene
from footfall.robot.model import Robot
from footfall.robot.tolerance import outside_in_words
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

NO_GROUND, TRUE, RAISED = "none", "true", "raised"
"""The ground modes of robot/meshes/collision.py."""


class Situation:
    """Tests of single leg postures: limits, collision, and the balance of the feet that stay.

    The centre of mass moves with the leg; the polygon is that of the other feet's contacts.
    """

    def __init__(
        self, robot: Robot, dem: Dem, state: RobotState, leg: int, ground: Nearby, settings: StepSettings
    ) -> None:
        self.robot, self.state, self.leg, self.ground, self.settings = robot, state, leg, ground, settings
        self.T_site_base = np.asarray(state.T_site_base)
        self._own = slice(6 * leg, 6 * leg + 6)
        self.lower, self.upper = robot.lower[self._own], robot.upper[self._own]
        self.stance = LegStance(robot, dem, state, leg)
        self.others = self.stance.others
        self.footing = footing(self.stance, ground, settings)
        if settings.steep_ground:
            self._look_at_the_wheel()
        self._lift = {TRUE: 0.0, RAISED: settings.raise_terrain}
        self.mesh_queries = 0

    def for_swing(self, start: Array, goal: Array) -> "Situation":
        """The same tests, with the compiled check that ``steep_ground`` asks for between two postures (6,)."""
        ends = np.array([start, goal])
        if self.settings.steep_ground is not None or self.first_unsure(ends, RAISED) == len(ends):
            return self
        other = copy(self)
        other._look_at_the_wheel()
        return other

    def _look_at_the_wheel(self) -> None:
        self.footing = replace(self.footing, certificate=self.footing.certificate.of_drum)

    @cached_property
    def _scene(self) -> CollisionScene:
        """The rover's meshes without ground, for what the certificate leaves unsure."""
        return CollisionScene(self.robot, self.state.posture, self.leg, self.T_site_base, None, self.settings.clearance)

    def posture(self, q: Array) -> Array:
        """Whole posture with this leg at q (6,)."""
        return self.stance.posture(q)

    def wheel(self, q: Array) -> Array:
        """T_base_wheel (4, 4) of this leg at q (6,)."""
        return leg_wheel_pose(self.robot, q, self.leg)

    def margin(self, q: Array) -> float:
        """Margin of the centre of mass at q (6,) to the remaining feet's polygon [m]; −inf where there is none."""
        normals, offsets = self.footing.normals, self.footing.offsets
        if not len(offsets):
            return -np.inf
        com_xy = apply(self.T_site_base, center_of_mass(self.robot, self.posture(q)))[:2]
        return float((offsets - normals @ com_xy).min())

    def collides(self, q: Array, terrain: str) -> bool:
        """Collision at q (6,) with the ground as it is (TRUE) or raised for the swing (RAISED), or with the rover."""
        if self.first_unsure(q[None], terrain) == 1:
            return False
        self.mesh_queries += 1
        if self.first_unsure(q[None], NO_GROUND) == 0 and self._scene.collides(q, NO_GROUND):
            return True
        return self.footing.over_ground.collision(q[None], self._lift[terrain], terrain == TRUE) is not None

    def spare(self, q: Array) -> float:
        """What q (6,), its wheel on the ground, has to spare beyond every clearance [m]; negative: it lacks some."""
        own = self.footing.solids.own_gap(q[None])[1].spare
        # the ground is looked at no farther than what is nearer already, and not at all where that is too near
        return own if own <= 0 else self.footing.over_ground.gap(q[None], 0.0, touching=True, below=own)[1].spare

    def first_unsure(self, qs: Array, terrain: str) -> int:
        """The first of n postures (n, 6) that is not surely free, or n."""
        return self.footing.certificate.first_unsure(qs, terrain)

    def free(self, q: Array, terrain: str) -> bool:
        """Whether q (6,), inside its limits, keeps all clearances and the balance."""
        if self.first_unsure(q[None], terrain) == 1:
            return True
        return self.margin(q) >= self.settings.least_margin and not self.collides(q, terrain)

    def objection(self, q: Array, terrain: str) -> str:
        """What forbids q (6,), with sizes, for a person; empty where nothing does."""
        if self.first_unsure(q[None], terrain) == 1:
            return ""
        if farthest_past(self.robot, q, self._own).excess > 0:
            return outside_in_words(self.robot, self.posture(q))
        hits = self._scene.contacts(q, NO_GROUND)
        hits += self.footing.over_ground.contacts(q, self._lift[terrain], terrain == TRUE)
        if hits:
            met = worst(hits, self.robot, self.ground.dem, self.posture(q), self.T_site_base, self._lift[terrain])
            what = met.hit.link_b
            if what == TERRAIN and terrain == RAISED:
                what = f"the terrain raised by {self.settings.raise_terrain:z.2f} m"
            return in_words(met, self.robot, what)
        margin = self.margin(q)
        if margin < self.settings.least_margin:
            kind = "conservative support polygon" if self.settings.conservative else "support polygon"
            if margin == -np.inf:
                return f"the {len(self.others)} feet that stay have no {kind}"
            kept, wanted = beside(margin, self.settings.least_margin)
            return (
                f"the centre of mass keeps a margin of {kept} m to the {kind} of the other feet, {wanted} m is wanted"
            )
        return ""

    def fixed_contacts(self, q: Array) -> list[Collision]:
        """Links of the leg at q (6,) that are too near to what does not move, and by how much; the ground aside."""
        own = {link_name(self.leg, part) for part in PARTS}
        return [hit for hit in self._scene.contacts(q, NO_GROUND) if hit.link_b not in own]
