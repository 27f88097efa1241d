"""Replays: the same products from the same parents, and every tampering told by name."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from footfall.io.artifacts import encode
from footfall.io.bundles import log_bytes, write_zip
from footfall.planning.step.problem import StepSettings
from footfall.processor import LATE
from footfall.sequence.edit import Edit
from footfall.session.replay import recompute
from footfall.session.replay.compare import differences
from footfall.session.replay.recompute import replay
from footfall.session.storage.store import read_session


@pytest.fixture
def whole(sessions, session):
    """A closed session with one product of each kind but terrain."""
    session.maps.compute(2).finish()
    session.maps.choose_footfall(2, 1.0, 0.0)
    session.plans.step(2).finish()
    sequence = session.sequences.make()
    session.sequences.edit(sequence, Edit("duration", 0, number=20.0))
    session.sequences.export(format="json")
    session.close()
    return session


def played(session, tiny, **about):
    return replay(session.store.folder, recipes=tiny.RECIPES, **about)


def test_a_whole_session_replays_to_the_last_bit(whole, tiny, tmp_path):
    texts = []
    report = played(whole, tiny, progress=lambda fraction, text: texts.append(fraction))
    assert report.ok
    assert [p.verdict for p in report.products] == ["same"] * 5
    assert [p.kind for p in report.products] == ["maps", "plan", "sequence", "edit", "export"]
    assert report.state is not None
    assert report.state.digest == whole.state.digest
    assert texts == sorted(texts)
    packed = tmp_path / "whole.zip"
    packed.write_bytes(write_zip(read_session(whole.store.folder)))
    assert replay(packed, recipes=tiny.RECIPES).as_dict() == report.as_dict()
    unchecked = replay(packed.read_bytes(), check=False)
    assert unchecked.ok
    assert {p.verdict for p in unchecked.products} == {"unchecked"}


def test_other_code_is_told_with_field_and_size(whole, tiny):
    def other_maps(parents, settings, progress):
        made = tiny.maps(parents, settings, progress)
        margin = made.layers["margin"].copy()
        margin[3, 4] += 0.5
        return replace(made, layers={**made.layers, "margin": margin})

    report = replay(whole.store.folder, recipes={**tiny.RECIPES, "maps": other_maps})
    assert not report.ok
    found = report.products[0]
    assert (found.verdict, found.difference) == ("different", "layers['margin'][3, 4]")
    assert found.magnitude == pytest.approx(0.5)
    assert [p.verdict for p in report.products[1:]] == ["same"] * 4


def test_what_differs_may_come_of_arithmetic_chosen_late(whole, tiny, monkeypatch):
    def other_plan(parents, settings, progress):
        made = tiny.plan(parents, settings, progress)
        return replace(made, plan=replace(made.plan, waypoints=made.plan.waypoints + 1e-3))

    recipes = {**tiny.RECIPES, "plan": other_plan}
    assert LATE not in replay(whole.store.folder, recipes=recipes).products[1].text
    monkeypatch.setattr(recompute, "choose_arithmetic", lambda: False)
    found = replay(whole.store.folder, recipes=recipes).products[1]
    assert found.verdict == "different"
    assert found.text.endswith(LATE)


def test_rounding_of_another_processor_is_told_but_accepted(whole, tiny):
    def rounded(parents, settings, progress):
        made = tiny.plan(parents, settings, progress)
        return replace(made, plan=replace(made.plan, waypoints=made.plan.waypoints + 1e-13))

    report = replay(whole.store.folder, recipes={**tiny.RECIPES, "plan": rounded})
    assert report.ok
    found = report.products[1]
    assert found.verdict == "equal_within"
    assert found.magnitude is not None
    assert 0 < found.magnitude < 1e-9


def test_tampered_and_missing_artifacts_are_named(whole, tiny):
    folder = whole.store.folder / "artifacts"
    dem = whole.state.dem
    (folder / f"{dem}.npz").write_bytes(encode(tiny.dem(0.5)))
    report = played(whole, tiny)
    assert not report.ok
    assert dem in report.problems[0]
    assert {p.kind for p in report.products if p.verdict == "missing"} == {"maps", "plan", "sequence", "edit"}
    (folder / f"{dem}.npz").unlink()
    report = played(whole, tiny)
    assert f"{dem}.npz is missing" in report.problems[0]
    export = whole.state.exports[0].digest
    (folder / f"{export}.json").write_bytes(b"{}")
    assert played(whole, tiny).products[-1].verdict == "missing"


def test_settings_changed_behind_the_log_show(whole, tiny):
    folder = whole.store.folder / "artifacts"
    made = whole.state.products[whole.state.plan]
    asked = whole.get(made.settings)
    other = replace(asked, settings=replace(asked.settings, seed=99))
    (folder / f"{made.settings}.npz").write_bytes(encode(other))
    plan = played(whole, tiny).products[1]
    assert plan.verdict == "missing"
    assert made.settings in plan.text


def test_a_changed_log_is_refused(whole, tiny, tmp_path):
    bundle = read_session(whole.store.folder)
    packed = write_zip(replace(bundle, files={}))
    lines = log_bytes(bundle.records).replace(b'"leg":2', b'"leg":3', 1)
    changed = tmp_path / "changed.zip"
    with zipfile.ZipFile(io.BytesIO(packed)) as whole_zip, zipfile.ZipFile(changed, "w") as archive:
        archive.writestr("session.json", whole_zip.read("session.json"))
        archive.writestr("events.jsonl", lines)
    database = whole.store.folder.parent / "footfall.sqlite"
    data = database.read_bytes()
    assert data.count(b'"leg":2') > 1
    database.write_bytes(data.replace(b'"leg":2', b'"leg":3', 1))
    for source in (changed, whole.store.folder):
        report = replay(source, recipes=tiny.RECIPES)
        assert not report.ok
        assert "was changed" in report.problems[0]


def test_a_search_that_ran_out_of_time_is_not_reproducible(session, tiny):
    session.plans.step(0, (3.5, 0.0), StepSettings(planner="line")).finish()
    session.close()

    def luckier(parents, settings, progress):
        chosen = replace(settings, settings=replace(settings.settings, planner="astar"))
        return tiny.plan(parents, chosen, progress)

    report = replay(session.store.folder, recipes={**tiny.RECIPES, "plan": luckier})
    assert report.ok
    assert report.products[0].verdict == "not_reproducible"
    assert "time limit" in report.products[0].text


def test_recipes_that_raise_fail_their_product_only(whole, tiny):
    report = replay(whole.store.folder, recipes={**tiny.RECIPES, "maps": tiny.breaks})
    assert report.products[0].verdict == "failed"
    assert "a bug" in report.products[0].text
    assert report.products[1].verdict == "same"


def test_an_interrupt_inside_compiled_code_ends_the_replay(whole, tiny):
    """numba makes a SystemError of it; taken for a failure, the session was said not to be the same."""

    def interrupted(parents, settings, progress):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    with pytest.raises(KeyboardInterrupt):
        replay(whole.store.folder, recipes={**tiny.RECIPES, "maps": interrupted})


def test_no_bundle_at_all(tmp_path):
    assert "no session bundle" in replay(tmp_path / "nothing").problems[0]
    empty = tmp_path / "empty.zip"
    zipfile.ZipFile(empty, "w").close()
    assert not replay(empty).ok


def test_differences_see_what_a_digest_sees(tiny):
    dem = tiny.dem()
    holes = dem.heights.copy()
    holes[0, 0] = np.nan
    (found,) = differences(dem, replace(dem, heights=holes))
    assert (found.path, found.magnitude) == ("heights[0, 0]", float("inf"))
    assert not list(differences(replace(dem, heights=holes), replace(dem, heights=holes.copy())))
    (found,) = differences({"a": 1}, {"a": 2})
    assert found.path == "['a']"
