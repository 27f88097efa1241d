"""Seeded steps, planned from telemetry and commanded in each mode, go in physics as they were predicted."""

from dataclasses import replace

import pytest

from footfall.core.errors import InvalidInput
from footfall.planning.execution.execution_settings import MODES

pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def campaign():
    from benchmarks import referee

    return referee


def test_a_step_on_the_moon_holds_the_floors_in_every_mode(campaign):
    found = campaign.outcomes(4)
    assert str(found[0].case) == "4 (fractal, moon, empty, known)"
    assert [one.mode for one in found] == list(MODES)
    assert [(one.mode, one.refused, one.missed()) for one in found] == [(mode, "", []) for mode in MODES]


@pytest.mark.parametrize(
    ("number", "mode", "about"),
    [
        (13, "droop_aware", "13 (fractal, earth, empty, unknown)"),
        # a wheel stands on the flank of a rock: it slid while the ground under it was taken for a plane
        (26, "pose_held", "26 (rocks, earth, empty, known)"),
        # such a wheel was given forces of least norm at the end, which pushed it along the flank
        (62, "pose_held", "62 (rocks, earth, empty, unknown)"),
    ],
)
def test_a_step_on_earth_holds_the_floors(campaign, number, mode, about):
    case = campaign.case_of(number)
    assert str(case) == about
    start = campaign.start_of(case)
    assert start is not None
    one = campaign.outcome(case, start, mode)
    assert not one.refused
    assert not one.missed()


def test_a_campaign_of_any_size_goes_through_the_settings(campaign):
    for count in (6, 24, 200):
        numbers = campaign.spread(count)
        assert len(set(numbers)) == len(numbers) == count
        cases = [campaign.case_of(number) for number in numbers]
        for name, values in (("ground", 3), ("gravity", 2), ("payload", 2), ("known", 2)):
            assert len({getattr(case, name) for case in cases}) == values, (count, name)
    settings = [campaign.case_of(number) for number in range(24)]
    assert len({(case.ground, case.gravity, case.payload, case.known) for case in settings}) == 24


def test_a_campaign_that_was_stopped_goes_on_where_it_was(campaign, monkeypatch, tmp_path):
    state, asked = tmp_path / "state.jsonl", []

    def outcomes(number):
        asked.append(number)
        case = campaign.case_of(number)
        return [campaign.Outcome(case, mode, slip=0.001 * number, said=("slid",)) for mode in MODES]

    monkeypatch.setattr(campaign, "outcomes", outcomes)
    whole = list(campaign.run([5, 2, 9], 1))
    assert [repr(one) for one in campaign.run([5, 2], 1, state)] == [repr(one) for one in whole[: 2 * len(MODES)]]
    # stopped in the middle of a line: that case is run again
    state.write_text(state.read_text()[:-5])
    asked.clear()
    assert [repr(one) for one in campaign.run([5, 2, 9], 1, state)] == [repr(one) for one in whole]
    assert asked == [2, 9]
    monkeypatch.setattr(campaign, "SEED", 1)
    with pytest.raises(InvalidInput, match="another seed"):
        list(campaign.run([5], 1, state))


def test_what_misses_a_floor_is_named(campaign):
    case = campaign.case_of(0)
    good = campaign.Outcome(
        case, "pose_held", touch=0.001, slip=0.0, chassis=0.002, sag=0.5, clearance=0.06, contact=0.001, met=0.001
    )
    assert good.missed() == []
    bad = replace(good, tips=1, touch=0.006, met=0.007, clearance=0.04)
    assert bad.missed() == ["tips", "touch 0.0060", "met 0.0070", "clearance 0.0400"]
    # what was not measured holds nothing
    assert "slip nan" in campaign.Outcome(case, "pose_held").missed()
    assert campaign.Outcome(case, "pose_held", refused="too steep").missed() == []
    figures = {figure.name: figure for figure in campaign.figures_of([good, bad])}
    assert figures["referee.known.pose_held.touch.worst"].as_dict()["holds"] is False
    assert figures["referee.known.pose_held.tips"].samples == (1.0,)
