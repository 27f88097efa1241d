"""FootFall: a ground tool for walking rovers. The names below are the interface for scripts."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from footfall.processor import choose_arithmetic

choose_arithmetic()

from footfall.core.value import SOFTWARE_VERSION  # noqa: E402 (numpy comes with it)

if TYPE_CHECKING:
    from footfall.balance.tether import Tether
    from footfall.io.any_robot import load_robot
    from footfall.io.exports import export
    from footfall.io.imports import read_sequence
    from footfall.io.scripting import make_sequence
    from footfall.io.terrain_files import read_terrain
    from footfall.planning.any_robot import compute_maps, plan_route, plan_step, plan_walk, stand
    from footfall.planning.body.body_move import plan_body_move
    from footfall.planning.body.body_shift import BodyShift
    from footfall.planning.body.find_shift import find_shift
    from footfall.planning.body.shift import shifted_state
    from footfall.planning.execution.plan import plan_execution
    from footfall.planning.gait.plan import plan_gait
    from footfall.session.replay.recompute import replay

_where = {
    "load_robot": "footfall.io.any_robot",
    "read_terrain": "footfall.io.terrain_files",
    "stand": "footfall.planning.any_robot",
    "BodyShift": "footfall.planning.body.body_shift",
    "Tether": "footfall.balance.tether",
    "shifted_state": "footfall.planning.body.shift",
    "plan_body_move": "footfall.planning.body.body_move",
    "find_shift": "footfall.planning.body.find_shift",
    "compute_maps": "footfall.planning.any_robot",
    "plan_step": "footfall.planning.any_robot",
    "plan_gait": "footfall.planning.gait.plan",
    "plan_walk": "footfall.planning.any_robot",
    "plan_route": "footfall.planning.any_robot",
    "plan_execution": "footfall.planning.execution.plan",
    "make_sequence": "footfall.io.scripting",
    "export": "footfall.io.exports",
    "read_sequence": "footfall.io.imports",
    "replay": "footfall.session.replay.recompute",
}

__version__ = SOFTWARE_VERSION

__all__ = [
    "BodyShift",
    "Tether",
    "__version__",
    "compute_maps",
    "export",
    "find_shift",
    "load_robot",
    "make_sequence",
    "plan_body_move",
    "plan_execution",
    "plan_gait",
    "plan_route",
    "plan_step",
    "plan_walk",
    "read_sequence",
    "read_terrain",
    "replay",
    "shifted_state",
    "stand",
]


def __getattr__(name: str) -> Any:
    # The numeric libraries take over a second to load; a script pays only for what it names.
    if name in _where:
        return getattr(import_module(_where[name]), name)
    raise AttributeError(f"footfall has no {name!r}; it has {', '.join(_where)}")
