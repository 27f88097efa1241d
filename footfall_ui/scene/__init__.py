"""The scene in three dimensions: what the session holds, drawn with viser. It owns no state."""

from footfall_ui.scene.drawing import Scene

__all__ = ["Scene"]
