"""Short routes: they arrive, or say how they ended; from them to a table and a comparison by the commands."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from footfall.io.policies import read_policy
from footfall.io.terrain_files import write_terrain
from footfall.planning.choice.actions import TRIPOD
from footfall.planning.choice.choice_settings import ChoiceSettings
from footfall.terrain.from_arrays import from_heights
from training import evaluate, gait_policy, route
from training.choosers import NAMES
from training.grounds import ground
from training.route import ARRIVED, MOST_REFUSED, NO_START, STUCK, walked

SETTINGS = ChoiceSettings()
EASY = 1
"""A seed whose ground a tripod walks over."""


def test_a_route_arrives_and_is_the_same_again():
    one, again = (walked(EASY, 1.2, lambda _: TRIPOD, SETTINGS) for _ in range(2))
    assert one.ended == ARRIVED
    assert one.as_json == again.as_json
    assert one.metres == pytest.approx(1.2, abs=0.05)
    assert [decision.action for decision in one.decisions] == [TRIPOD, TRIPOD]
    # what is seen after one decision is what the next one is made from
    assert one.decisions[0].after == one.decisions[1].seen
    assert one.decisions[1].seen.current == TRIPOD


def test_a_route_on_which_all_is_refused_is_stuck():
    weak = replace(SETTINGS, gaits=replace(SETTINGS.gaits, most_torque=0.05))
    ended = walked(EASY, 1.2, lambda _: TRIPOD, weak)
    assert ended.ended == STUCK
    assert len(ended.decisions) == MOST_REFUSED
    assert [decision.seen.refused for decision in ended.decisions] == [False, True, True, True]
    assert ended.metres == 0.0


def test_where_nobody_can_stand_no_route_begins(monkeypatch):
    def walled(seed, metres):
        made = ground(seed, metres)
        x, _ = np.meshgrid(made.geometry.xs, made.geometry.ys)
        heights = np.where(np.sin(7.0 * x) > 0.0, 4.0, 0.0).astype(np.float32)
        return replace(made, heights=heights)

    monkeypatch.setattr(route, "ground", walled)
    assert walked(EASY, 1.2, lambda _: TRIPOD, SETTINGS).ended == NO_START


def test_from_the_commands_to_a_comparison(tmp_path, monkeypatch, capsys):
    """One route of one iteration each; learned twice, the second time from what is finished."""
    out = tmp_path / "gaits.npz"
    tables = []
    for _ in range(2):
        monkeypatch.setattr("sys.argv", ["", "--seeds", "1", "--metres", "0.6", "--out", str(out)])
        assert gait_policy.main() == 0
        tables.append(out.read_bytes())
    assert tables[0] == tables[1]
    policy = read_policy(out, route.robot().digest, gait_policy.SETTINGS)
    assert policy.visits.sum() >= 1
    assert policy.digest in capsys.readouterr().out
    monkeypatch.setattr("sys.argv", ["", str(out), "--routes", "1", "--metres", "0.6"])
    assert evaluate.main() == 0
    told = capsys.readouterr().out
    assert all(f"\n{name}: time per metre" in told for name in NAMES)
    assert told.count("no gain is shown") + told.count("learning gives") == len(NAMES) - 1
    write_terrain(from_heights(np.zeros((120, 120), np.float32), 0.1, 0.0, 0.0, "plain"), tmp_path / "plain.tif")
    monkeypatch.setattr("sys.argv", [*sys.argv, "--map", str(tmp_path / "plain.tif")])
    assert evaluate.main() == 0
    assert "1 of 1 routes of 0.6 m begin with a stance; over plain" in capsys.readouterr().out
