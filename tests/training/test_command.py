"""What the commands that learn, compare and audit refuse before they make any route."""

import sys

import pytest

from training import audit, evaluate, gait_policy


@pytest.mark.parametrize(
    ("option", "given", "said"),
    [
        ("count", "-5", "-5 is less than 1"),
        ("count", "0", "0 is less than 1"),
        ("count", "10001", "ground for 10000 routes at most, not for 10001"),
        ("--processes", "0", "0 is less than 1"),
        ("--metres", "0", "longer than 0 m"),
        ("--metres", "nan", "longer than 0 m"),
        ("--metres", "inf", "longer than 0 m"),
    ],
)
@pytest.mark.parametrize("command", [gait_policy, evaluate, audit], ids=["learn", "compare", "audit"])
def test_numbers_that_make_no_routes_are_refused(monkeypatch, capsys, tmp_path, command, option, given, said):
    learns = command is gait_policy
    of = ["--out", str(tmp_path / "a.npz")] if learns else [str(tmp_path / "a.npz")]
    named = ("--seeds" if learns else "--routes") if option == "count" else option
    monkeypatch.setattr(sys, "argv", ["x", *of, named, given])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert f"argument {named}: " in told
    assert said in told
    assert not list(tmp_path.iterdir())
