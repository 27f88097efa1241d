"""``footfall replay`` as a pipeline calls it: in a process of its own, by exit code and JSON."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from footfall.maps.layers import MapStack
from footfall.planning.body.stand import stand
from footfall.session.jobs import recipes
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from footfall.terrain.generate import plane
from tests.support.command_line import FOOTFALL
from tests.support.waiting import BOUND

SAMPLES = Path(__file__).resolve().parents[2] / "sample_sessions"


@pytest.fixture
def sample(tmp_path) -> Path:
    return Path(shutil.copytree(SAMPLES / "edited-export", tmp_path / "edited-export"))


def replayed(*bundles: Path, code: int) -> dict[str, Any]:
    command = [*FOOTFALL, "replay", *map(str, bundles), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=BOUND)
    assert done.returncode == code, done.stderr
    report = json.loads(done.stdout)
    assert report["ok"] is (code == 0)
    return report["bundles"]


def test_products_of_other_code_fail_and_are_named(tmp_path, monkeypatch):
    """Recorded with a recipe that is planted to give another margin in one cell; replayed with the true one."""
    true_maps = recipes.RECIPES["maps"]

    def other_maps(parents, settings, progress):
        made = true_maps(parents, settings, progress)
        assert isinstance(made, MapStack)
        margin = made.layers["margin"].copy()
        margin[50, 50] = 7.0
        return replace(made, layers={**made.layers, "margin": margin})

    monkeypatch.setattr(recipes, "RECIPES", {**recipes.RECIPES, "maps": other_maps})
    dem = plane(size=10.0, resolution=0.1)
    with Sessions(tmp_path, jobs=InlineJobs()) as sessions:
        live = sessions.create("by other code")
        live.terrains.load(dem)
        live.stances.set(stand(live.robot, dem))
        live.maps.compute(2).finish()
        folder = tmp_path / live.id
    (product,) = replayed(folder, code=1)[str(folder)]["products"]
    assert (product["kind"], product["verdict"]) == ("maps", "different")
    assert product["difference"] == "layers['margin'][50, 50]"


def test_a_changed_artifact_fails_by_its_name_and_spares_the_other_bundles(sample):
    (export,) = sample.glob("artifacts/*.csv")
    export.write_bytes(export.read_bytes().replace(b"0.", b"1.", 1))
    other = SAMPLES / "refused-step"
    told = replayed(sample, other, code=1)
    assert told[str(sample)]["ok"] is False
    assert export.stem in " ".join(
        [*told[str(sample)]["problems"], *(product["text"] for product in told[str(sample)]["products"])]
    )
    assert told[str(other)]["ok"] is True


def test_a_changed_event_fails(sample):
    log = sample / "events.jsonl"
    log.write_text(log.read_text().replace('"leg":4', '"leg":3', 1))
    (problem,) = replayed(sample, code=1)[str(sample)]["problems"]
    assert "was changed" in problem


def test_what_is_as_it_was_passes(sample):
    assert replayed(sample, code=0)[str(sample)]["problems"] == []
