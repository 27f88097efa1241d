"""What a benchmark's figure promises is what is checked: its median, and where asked its p95."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import run
from benchmarks.steps import figures as problem_set
from benchmarks.steps.families import problem
from benchmarks.timing import Figure, promised

SAMPLES = st.lists(st.floats(0.0, 1e3), min_size=1, max_size=50)


@given(SAMPLES, st.floats(0.0, 1e3), st.booleans(), st.floats(0.0, 1e3))
def test_a_floor_holds_where_enough_samples_are_on_its_good_side(samples, floor, at_most, p95_at_most):
    row = Figure("one", tuple(samples), "s", floor, at_most, p95_at_most).as_dict()
    good = np.array(samples) <= floor if at_most else np.array(samples) >= floor
    if good.mean() > 0.5:
        assert row["holds"]
    if good.mean() < 0.5:
        assert not row["holds"]
    few = np.sum(np.array(samples) > p95_at_most) / len(samples)
    if few == 0:
        assert row["p95_holds"]
    if few > 0.05 + 1 / len(samples):
        assert not row["p95_holds"]
    assert row["n"] == len(samples)


def test_what_is_promised_is_said_with_whether_it_holds():
    slow_at_times = Figure("one", (0.001,) * 9 + (1.0,), "s", 0.005, p95_at_most=0.01).as_dict()
    assert promised(slow_at_times) == "0.005 holds, p95 0.01 DOES NOT HOLD"
    assert promised(Figure("one", (3.0,), "ratio", 2.0, at_most=False).as_dict()) == "2 holds"
    assert promised(Figure("one", (3.0,), "s", p95_at_most=2.0).as_dict()) == "p95 2 DOES NOT HOLD"
    assert promised(Figure("one", (3.0,), "s").as_dict()) == ""


@pytest.mark.parametrize(
    ("figure", "code"),
    [
        (Figure("one", (1.0,), "s"), 0),
        (Figure("one", (1.0,), "s", 1.0, p95_at_most=1.0), 0),
        (Figure("one", (1.0,), "s", 0.9), 1),
        (Figure("one", (0.1,) * 9 + (1.0,), "s", 0.9, p95_at_most=0.5), 1),
    ],
)
@pytest.mark.parametrize("as_json", [False, True])
def test_a_run_fails_where_a_median_or_a_p95_misses(monkeypatch, capsys, figure, code, as_json):
    monkeypatch.setattr(run, "AREAS", {"one": lambda quick: iter([figure])})
    assert run.main(["one"], as_json=as_json) == code
    printed = capsys.readouterr().out
    assert "one" in printed
    if not as_json:
        assert ("DOES NOT HOLD" in printed) == bool(code)


def test_what_a_comparison_leaves_out_is_counted_and_said(monkeypatch, capsys):
    raw = problem_set.Raw("bug trap", False, 0.001, 0.2, 0.1, 0.3)
    answers = [raw, "our search found nothing", raw, "our search found nothing", "an end is blocked"]
    monkeypatch.setattr(problem_set, "find_spec", lambda name: object())
    monkeypatch.setattr(problem_set, "_raws", lambda problems, quick: answers)
    rows = {figure.name: figure for figure in problem_set._raw_figures([problem("bug trap", 0)] * 5, False)}
    assert rows["step.klampt_compared"].samples == (0.4,)
    assert rows["step.klampt_sbl_defaults_to_raw"].samples == pytest.approx((200.0, 200.0))
    said = capsys.readouterr().err
    assert "2 of 5 problems compared" in said
    assert "worst family bug trap, 200 times" in said
    assert "2 left out: our search found nothing; 1 left out: an end is blocked" in said


def test_every_family_is_compared_with_klampt_and_the_worst_is_named(monkeypatch, capsys):
    raw = [problem_set.Raw(name, False, 0.001, ratio / 1e3, 0.1, 0.3) for name, ratio in FAMILIES]
    monkeypatch.setattr(problem_set, "find_spec", lambda name: object())
    monkeypatch.setattr(problem_set, "_raws", lambda problems, quick: raw)
    asked = [problem(name, 0) for name, _ in FAMILIES]
    rows = {figure.name: figure.as_dict() for figure in problem_set._raw_figures(asked, False)}
    # the old figure is of the hard families; the others no longer are left out of all
    name = "step.klampt_sbl_defaults_to_raw"
    assert (rows[name]["n"], rows[f"{name}.all_families"]["n"]) == (2, 5)
    assert rows[f"{name}.steep_fractal"]["median"] == pytest.approx(40.0)
    assert rows[f"{name}.steep_fractal"]["holds"] is False
    assert rows[f"{name}.long_reach"]["holds"] is True
    assert rows[f"{name}.worst_family"]["median"] == pytest.approx(40.0)
    assert rows[f"{name}.worst_family"]["holds"] is False
    assert rows["step.set_raw.steep_fractal"]["holds"] is True
    assert "worst family steep fractal, 40 times" in capsys.readouterr().err


FAMILIES = [
    ("bug trap", 200.0),
    ("over a rock", 100.0),
    ("steep fractal", 30.0),
    ("steep fractal", 50.0),
    ("long reach", 60.0),
]
