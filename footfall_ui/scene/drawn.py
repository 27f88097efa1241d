"""The things of one drawing in viser, by name."""

from collections.abc import Callable, Collection
from typing import Concatenate, ParamSpec, TypeVar

import viser

from footfall_ui.scene.labels import labels_of

_Given = ParamSpec("_Given")
_Handle = TypeVar("_Handle", bound=viser.SceneNodeHandle)


def server_of(drawn: viser.ViserServer | viser.ClientHandle) -> viser.ViserServer:
    """The server of a page, where it is one."""
    return drawn._viser_server if isinstance(drawn, viser.ClientHandle) else drawn


class Drawn:
    """A thing that comes takes the place of the one of its name; taking away can be tried again where it failed."""

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self._server = server
        self._handles: dict[str, viser.SceneNodeHandle | None] = {}

    def add(
        self,
        make: Callable[Concatenate[str, _Given], _Handle],
        name: str,
        *args: _Given.args,
        **kwargs: _Given.kwargs,
    ) -> _Handle:
        """Draw a thing with one of the scene's ``add_…``; what failed half way is taken away as well."""
        self._handles[name] = None
        made = make(name, *args, **kwargs)
        self._handles[name] = made
        if isinstance(made, viser.LabelHandle):
            labels_of(self._server).add(made)
        return made

    def only(self, names: Collection[str]) -> None:
        """Take away everything else."""
        for name in [name for name in self._handles if name not in names]:
            there, mine = self._server.scene.get_handle_by_name(name), self._handles[name]
            if mine is None:
                # drawn half: pages may have it, whether or not viser knows of it
                self._server.scene.add_frame(name, show_axes=False).remove()
            elif there is mine:  # else the removal of its parent, or one that failed half way, has taken it away
                mine.remove()
            del self._handles[name]

    def clear(self) -> None:
        """Take everything away."""
        self.only(())
