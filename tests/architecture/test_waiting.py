"""Nothing in the tests decides by the clock: they wait through ``tests/support/waiting.py``, within its bound."""

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
MEASURE = {"support/waiting.py", "support/run_record.py", "support/late.py"}
"""Where time may be looked at: the one way of waiting, what tells where time goes, what makes things late."""
STAND_INS = {
    "session/tiny_recipes.py": "slow work; worker processes import it by name",
    "session/warm_recipes.py": "slow work; worker processes import it by name",
    "planning/test_step_searches.py": "a search that runs past its time limit",
    "api/test_foxglove_live.py": "a viewer that listens for a while to whatever comes",
}
CLOCKS = {"sleep", "perf_counter", "process_time", "monotonic", "time"}
WAITS = {"wait", "join", "recv", "finish", "result", "communicate", "run"}


def files():
    left_out = MEASURE | STAND_INS.keys()
    return [path for path in sorted(TESTS.rglob("*.py")) if path.relative_to(TESTS).as_posix() not in left_out]


def is_of_time(call: ast.AST) -> bool:
    return (
        isinstance(call, ast.Call)
        and isinstance(call.func, ast.Attribute)
        and isinstance(call.func.value, ast.Name)
        and call.func.value.id == "time"
        and call.func.attr in CLOCKS
    )


def faults(tree: ast.AST) -> list[str]:
    """What of a file waits or decides by itself, with its line."""
    found: list[str] = []
    for one in ast.walk(tree):
        if isinstance(one, ast.Call) and isinstance(one.func, ast.Attribute):
            name = one.func.attr
            if is_of_time(one) and name == "sleep":
                found.append(f"{one.lineno}: time.sleep")
            bounds = [word.value for word in one.keywords if word.arg == "timeout"]
            bounds += one.args[:1] if name in ("wait", "join", "finish") and len(one.args) == 1 else []
            driven = isinstance(one.func.value, ast.Name) and one.func.value.id == "clock"
            if name in WAITS and not driven and any(seconds(bound) >= 10 for bound in bounds):
                found.append(f"{one.lineno}: a bound of its own in {name}()")
        if isinstance(one, ast.Compare) and any(is_of_time(part) for side in sides(one) for part in ast.walk(side)):
            found.append(f"{one.lineno}: compares a time of the clock")
    return found


def seconds(bound: ast.expr) -> float:
    """Of a bound that is written as a number; 0 of any other."""
    return float(bound.value) if isinstance(bound, ast.Constant) and isinstance(bound.value, (int, float)) else 0.0


def sides(compare: ast.Compare) -> list[ast.expr]:
    return [compare.left, *compare.comparators]


def test_tests_wait_in_one_way():
    told = [
        f"{path.relative_to(TESTS)}:{fault}"
        for path in files()
        for fault in faults(ast.parse(path.read_text(), filename=str(path)))
    ]
    assert not told, "\n".join(told)


@pytest.mark.parametrize(
    "text",
    [
        "time.sleep(1)",
        "assert time.monotonic() - began < 3",
        "while time.time() < end: pass",
        "thread.join(20)",
        "line.recv(timeout=60)",
        "subprocess.run(command, timeout=120)",
    ],
)
def test_what_waits_by_itself_is_found(text):
    assert faults(ast.parse(text))


def test_bounds_of_the_helper_and_what_must_not_happen_are_fine():
    assert faults(ast.parse("thread.join(BOUND)\nline.recv(timeout=BOUND)\na_while(0.5)\nclock.wait(0.2)")) == []
