"""What the meshes hit first: a collision scene that names the pair without measuring distances."""

from numpy.typing import ArrayLike

from footfall.core.mesh import Mesh
from footfall.robot.collision import GROUND_MODES, TERRAIN, CollisionScene
from footfall.robot.model import Robot


class NamingScene(CollisionScene):
    """A :class:`CollisionScene` whose answer is the first pair found, or None; see there for the arguments."""

    def __init__(
        self,
        robot: Robot,
        posture: ArrayLike,
        leg: int,
        T_site_base: ArrayLike,
        terrain_mesh: Mesh | None = None,
        clearance: float = 0.0,
        raise_terrain: float = 0.0,
    ) -> None:
        super().__init__(robot, posture, leg, T_site_base, terrain_mesh, clearance, raise_terrain)
        every = list(enumerate((pair.first, pair.second) for pair in self._pairs.objects.collisionPairs))
        self._active = {
            mode: [one for one in every if self._data[mode].activeCollisionPairs[one[0]]] for mode in GROUND_MODES
        }

    def first_contact(self, q_leg: ArrayLike, terrain: str) -> tuple[str, str] | None:
        """Names of two things that are closer than they may be ("leg3" for a frozen leg as a whole), or None."""
        data = self._placed(q_leg, terrain)
        if terrain != "none" and self._ground.any_below(data, self._lift[terrain]):
            return self._ground.below(data, self._lift[terrain])[0].link_a, TERRAIN
        if not self._pairs.any_too_close(data):
            return None
        # the check stops at the first hit, and the pairs before it have just been found free
        results = data.collisionResults
        hit = next(pair for i, pair in self._active[terrain] if results[i].isCollision())
        return self._pairs.label(hit[0]), self._pairs.label(hit[1])
