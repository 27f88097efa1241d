"""FootFall: a ground tool for walking rovers. The names below are the interface for scripts."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from footfall.core.value import SOFTWARE_VERSION

if TYPE_CHECKING:
    from footfall.io.exports import export
    from footfall.io.robot_files import load_robot
    from footfall.io.scripting import make_sequence
    from footfall.io.terrain_files import read_terrain
    from footfall.maps.stack import compute_maps
    from footfall.planning.stance.stand import stand
    from footfall.planning.step.plan import plan_step
    from footfall.session.replay import replay

_where = {
    "load_robot": "footfall.io.robot_files",
    "read_terrain": "footfall.io.terrain_files",
    "stand": "footfall.planning.stance.stand",
    "compute_maps": "footfall.maps.stack",
    "plan_step": "footfall.planning.step.plan",
    "make_sequence": "footfall.io.scripting",
    "export": "footfall.io.exports",
    "replay": "footfall.session.replay",
}

__version__ = SOFTWARE_VERSION

__all__ = [
    "__version__",
    "compute_maps",
    "export",
    "load_robot",
    "make_sequence",
    "plan_step",
    "read_terrain",
    "replay",
    "stand",
]


def __getattr__(name: str) -> Any:
    # The numeric libraries take over a second to load; a script pays only for what it names.
    if name in _where:
        return getattr(import_module(_where[name]), name)
    raise AttributeError(f"footfall has no {name!r}; it has {', '.join(_where)}")
