"""The friction that is counted on is one number in one place."""

import ast
from collections.abc import Iterator
from pathlib import Path

from footfall.balance.balance_settings import BalanceSettings
from footfall.balance.friction import FRICTION
from footfall.planning.body.find_problem import FindShiftSettings
from footfall.planning.body.move import BodyMoveSettings
from footfall.planning.step.problem import StepSettings
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sim.physics.physics_settings import PhysicsSettings

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = (BalanceSettings, StepSettings, BodyMoveSettings, FindShiftSettings, SequenceSettings, PhysicsSettings)


def numbers(source: str) -> Iterator[int]:
    """Lines where a field or a parameter called friction has a number of its own as default."""
    for part in ast.walk(ast.parse(source)):
        given: list[tuple[str, ast.expr | None]] = []
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            given = [(part.target.id, part.value)]
        elif isinstance(part, (ast.FunctionDef, ast.AsyncFunctionDef)):
            named = [*part.args.posonlyargs, *part.args.args]
            late = named[len(named) - len(part.args.defaults) :]
            given = [(one.arg, default) for one, default in zip(late, part.args.defaults, strict=True)]
            only = zip(part.args.kwonlyargs, part.args.kw_defaults, strict=True)
            given += [(one.arg, default) for one, default in only]
        yield from (
            default.lineno
            for name, default in given
            if name == "friction" and isinstance(default, ast.Constant) and isinstance(default.value, float)
        )


def test_nobody_has_a_friction_of_their_own() -> None:
    sources = [*(ROOT / "backend" / "footfall").rglob("*.py"), *(ROOT / "footfall_ui").rglob("*.py")]
    found = {str(p.relative_to(ROOT)): lines for p in sorted(sources) if (lines := list(numbers(p.read_text())))}
    assert not found, "read it from balance/friction.py"


def test_a_friction_of_its_own_is_found() -> None:
    source = "friction: float = 0.6\ndef a(friction=0.6, *, x=0.6): ...\ndef b(x, *, friction: float = 0.5): ...\n"
    assert sorted(numbers(source)) == [1, 2, 3]
    assert list(numbers("friction: float = FRICTION\ndef a(friction=FRICTION, x=0.6): ...\n")) == []


def test_all_settings_count_on_it() -> None:
    assert {settings().friction for settings in SETTINGS} == {FRICTION} == {0.6}
