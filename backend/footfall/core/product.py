"""Values that tell what they were computed from."""

from footfall.core.value import Provenance, Value


class Product(Value):
    """Base of a value with a provenance, which is its own field."""

    __slots__ = ()

    provenance: Provenance

    @property
    def parents(self) -> dict[str, str]:
        """Name → digest of the values it was computed from."""
        return dict(self.provenance.parents)
