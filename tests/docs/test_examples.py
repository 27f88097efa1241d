"""Every example runs as it stands, and its page names each."""

import re
import runpy
import sys
from pathlib import Path

import pytest

from tests.support.server import running_server
from tests.support.waiting import until

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SAID = {
    "terrain_to_map": r"stable: [1-9]\d* cells",
    "plan_a_step": r"^found: .*\n(?:  .+\n)+\d+ waypoints, digest [0-9a-f]{32}",
    "compare_planners": r"^auto: \d+ waypoints, joints travel \d+\.\d\d rad",
    "why_not": r"a shift of the chassis: found",
    "move_the_chassis": r"^0\.05 m forward: found, least margin \d+\.\d+",
    "predict_the_sag": r"touches down \d+\.\d mm from the plan",
    "export_everywhere": r"read back: [1-9]\d* commands, the same: True",
    "replay_a_session": r"^.+: the same\n  maps +[0-9a-f]+  same",
    "plot_a_map": r"drawn to .*map\.png",
}


def run(name, capsys, monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *map(str, arguments)])
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    return capsys.readouterr().out


@pytest.mark.parametrize("name", SAID)
def test_an_example_does_what_it_says(name, capsys, monkeypatch, tmp_path):
    picture = tmp_path / "map.png"
    out = run(name, capsys, monkeypatch, *([picture] if name == "plot_a_map" else []))
    assert re.search(SAID[name], out, re.M), out
    assert name != "plot_a_map" or picture.read_bytes().startswith(b"\x89PNG")


def test_the_example_over_rest(capsys, monkeypatch, tmp_path):
    with running_server(tmp_path, prepare=lambda sessions: sessions.open_sample("rock-step")) as server:
        server.rover.start()
        current = server.sessions.current
        until(lambda: current is not None and current.rover.frame, "the first telemetry")
        out = run("over_rest", capsys, monkeypatch, server.url)
    assert re.search(r"plan: done\nfound: .*\n[1-9]\d* commands, [1-9]\d* bytes of SeqJSON", out), out


def test_the_page_names_every_example():
    scripts = {path.stem for path in EXAMPLES.glob("*.py")}
    assert scripts == {*SAID, "over_rest"}
    named = re.findall(r"\[(\w+)\.py\]\(\1\.py\)", (EXAMPLES / "README.md").read_text())
    assert sorted(named) == sorted(scripts)
