"""viser's message buffer wakes its loop from whichever thread draws; here only the loop does."""

import asyncio

import viser


class LoopEvent(asyncio.Event):
    """An event that other threads can't set directly: ``asyncio.Event.set`` walks waiters that its loop changes."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._owner = loop

    def set(self) -> None:
        """Set it where the loop calls; another thread's call does nothing: that one asks the loop to as well."""
        try:
            here = asyncio.get_running_loop()
        except RuntimeError:
            return
        if here is self._owner:
            super().set()


def wake_in_loop(server: viser.ViserServer) -> None:
    """Make drawing from another thread safe, for all pages and for each; before any page is connected.

    viser 1.1.1 sets the buffer's event in the thread that draws, and asks the loop to set it too. The first is not
    thread-safe ("deque mutated during iteration"), and the second is enough.
    """
    buffer = server._websock_server._broadcast_buffer
    buffer.message_event = LoopEvent(buffer.event_loop)

    @server.on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        own = client._websock_connection.get_message_buffer()
        waited, own.message_event = own.message_event, LoopEvent(own.event_loop)
        waited.set()  # what waits for the old one goes on with the new one
