"""What the meshes hit first: a collision scene that names the pair without measuring distances."""

from functools import cached_property

from numpy.typing import ArrayLike

from footfall.robot.meshes.collision import GROUND_MODES, TERRAIN, CollisionScene


class NamingScene(CollisionScene):
    """A :class:`CollisionScene` whose answer is the first pair found, or None; see there for the arguments."""

    @cached_property
    def _active(self) -> dict[str, list[tuple[int, tuple[int, int]]]]:
        """The pairs that each ground mode checks, with their numbers; listed once, and not for each contact."""
        every = list(enumerate((pair.first, pair.second) for pair in self._pairs.objects.collisionPairs))
        return {mode: [one for one in every if self._data[mode].activeCollisionPairs[one[0]]] for mode in GROUND_MODES}

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
