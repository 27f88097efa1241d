"""A scene for each of viser's pages, drawn with what is chosen there: no page shows another's choices unasked."""

import threading
from dataclasses import asdict

import viser

from footfall.session.access.acting import acting
from footfall.session.access.identity import Identity
from footfall.session.live import LiveSession
from footfall_ui.scene import Scene
from footfall_ui.scene.wakeup import wake_in_loop
from footfall_ui.visitors import Visitors


class PageScenes:
    """Draws one session at a time for every page of a viser server, as long as that page is connected."""

    def __init__(self, server: viser.ViserServer, visitors: Visitors) -> None:
        wake_in_loop(server)
        self._server, self._visitors = server, visitors
        self._lock = threading.Lock()
        self._live: LiveSession | None = None
        self._pasts: dict[str, LiveSession] = {}
        self._scenes: dict[int, Scene] = {}
        self._closed = False
        server.scene.set_up_direction("+z")
        server.scene.world_axes.visible = False
        server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        server.scene.configure_default_lights(enabled=True, cast_shadow=False)
        server.on_client_connect(self._came)
        server.on_client_disconnect(self._went)

    def follow(self, live: LiveSession) -> None:
        """Draw this session from now on."""
        with self._lock:
            self._live = live
            self._pasts.clear()
            for scene in self._scenes.values():
                scene.follow(live)

    def look_back(self, who: Identity, past: LiveSession | None) -> None:
        """Draw the session as it was, in the scene of that page, with what it shows chosen; None: as it is now.

        It stays so until the page says otherwise: its connection may be lost meanwhile, and come back.
        """
        with self._lock:
            live = self._live
            if live is None:
                return
            if past is None:
                self._pasts.pop(who.seat, None)
            else:
                self._pasts[who.seat] = past
                with acting(who):
                    view = live.choices.view
                    past.choices.set_view(
                        leg=view.leg, layer=view.layer, opacity=view.opacity, shown=asdict(view.shown)
                    )
            for scene in self._scenes.values():
                if scene.is_of(who):
                    scene.follow(live if past is None else past)

    def close(self) -> None:
        """Draw nothing more."""
        with self._lock:
            self._closed, scenes, self._scenes = True, self._scenes, {}
        for scene in scenes.values():
            scene.close()

    # viser calls these in any of its threads, in any order

    def _came(self, page: viser.ClientHandle) -> None:
        with self._lock:
            if self._closed or page.client_id not in self._server.get_clients():
                return
            # what is drawn while a page goes is for nobody, and no fault
            page._websock_connection.get_message_buffer()._warned_push_after_done = True
            who = self._visitors.of(self._server, page.client_id)
            scene = Scene(page, self._visitors, who)
            self._scenes[page.client_id] = scene
            if self._live is not None:
                scene.follow(self._pasts.get(who.seat, self._live))

    def _went(self, page: viser.ClientHandle) -> None:
        with self._lock:
            scene = self._scenes.pop(page.client_id, None)
        if scene is not None:
            scene.close()
