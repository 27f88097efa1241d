"""What draws the scene of a test's server, to look into and to end."""

import viser

from footfall_ui.viser_door import SceneDoor, open_viser


class Drawing:
    """viser servers, in the order in which they were opened; as long as ``refused``, none is."""

    def __init__(self) -> None:
        self.servers: list[viser.ViserServer] = []
        self.refused = False

    def open(self) -> tuple[viser.ViserServer, SceneDoor]:
        """In place of ``open_viser``."""
        if self.refused:
            raise OSError("no more ports")
        server, door = open_viser()
        self.servers.append(server)
        return server, door
