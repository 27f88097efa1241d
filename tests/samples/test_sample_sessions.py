"""Golden replays: every product of every sample is recomputed from its parents and compared by digest."""

import math
from pathlib import Path

import pytest

import footfall
from footfall.cli.recorded import RecordedSession
from footfall.io.bundles import read_bundle
from footfall.planning.walk.problem import WalkResult
from footfall.resources import sample_sessions_folder

FOLDER = sample_sessions_folder()
SAMPLES = sorted(path.name for path in FOLDER.iterdir() if (path / "session.json").is_file())
KINDS = {
    "rock-step": {"terrain", "maps", "plan", "execution", "sequence", "export"},
    "rock-walk": {"terrain", "walk", "foot_moves", "export"},
    "rappel": {"walk"},
    "fractal-step": {"maps", "plan", "execution", "sequence"},
    "refused-step": {"maps", "plan"},
    "edited-export": {"plan", "sequence", "edit", "export"},
}


def test_the_samples_are_those_that_are_documented() -> None:
    assert set(SAMPLES) == set(KINDS)


@pytest.mark.parametrize("name", KINDS)
def test_replay(name: str) -> None:
    report = footfall.replay(FOLDER / name)
    assert report.ok, report.as_dict()
    assert {product.kind for product in report.products} == KINDS[name]
    # "equal_within": another processor may round differently; nothing else is accepted
    assert {product.verdict for product in report.products} <= {"same", "equal_within"}


def test_together_they_stay_small() -> None:
    size = sum(file.stat().st_size for file in Path(FOLDER).rglob("*") if file.is_file())
    assert size < 15e6


def test_the_refused_step_says_why() -> None:
    plan = next(e for e in read_bundle(FOLDER / "refused-step").records if e.get("payload", {}).get("kind") == "plan")
    assert plan["payload"]["status"] == "goal_invalid"
    assert "leg 0" in plan["payload"]["reason"]


def test_the_rappel_goes_down_on_its_tether() -> None:
    session = RecordedSession(FOLDER / "rappel")
    walk = next(e for e in read_bundle(FOLDER / "rappel").records if e.get("payload", {}).get("kind") == "walk")
    found = session.typed(WalkResult, walk["payload"]["digest"])
    assert found.plan is not None
    assert found.plan.tethered is not None
    # 2.75 m down a slope of 60°, which differs by what is irregular
    heights = found.plan.Ts_site_base[:, 2, 3]
    assert heights[0] - heights[-1] == pytest.approx(2.75 * math.sin(math.radians(60.0)), abs=0.3)
