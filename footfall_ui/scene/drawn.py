"""The things of one drawing in viser, by name."""

from collections.abc import Collection

import viser


class Drawn:
    """A thing that comes takes the place of the one of its name; taking away can be tried again where it failed."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._handles: dict[str, viser.SceneNodeHandle] = {}

    def keep(self, *handles: viser.SceneNodeHandle) -> None:
        """What was just added."""
        self._handles |= {handle.name: handle for handle in handles}

    def only(self, names: Collection[str]) -> None:
        """Take away everything else."""
        for name in [name for name in self._handles if name not in names]:
            # not where a try that failed half way, or the removal of its parent, has taken it away
            if self._server.scene.get_handle_by_name(name) is self._handles[name]:
                self._handles[name].remove()
            del self._handles[name]

    def clear(self) -> None:
        """Take everything away."""
        self.only(())
