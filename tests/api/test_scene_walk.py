"""What is drawn of a walk: its footfalls with number and leg, the chassis' way, how far it comes."""

from dataclasses import replace

import numpy as np
import pytest
import viser

import footfall
from footfall.planning.step.problem import Status
from footfall.planning.walk.problem import WalkGoal, WalkResult, WalkSettings
from footfall.session.jobs.local import InlineJobs
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.jobs.requests import WalkRequest
from footfall.session.products.kinds import WALK
from footfall.session.registry import Sessions
from footfall_ui.scene import Scene
from footfall_ui.scene.walk import OVER_GROUND, chassis_line, end_text, footfall_marks
from tests.support.chassis_ground import wavy
from tests.support.short_walks import LEG, short_walk
from tests.support.waiting import until


@pytest.fixture(scope="module")
def ground():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def stood(athlete, ground):
    return footfall.stand(athlete, ground)


@pytest.fixture(scope="module")
def walk(athlete, ground, stood):
    return short_walk(athlete, ground, stood)


def answer(walk, found):
    told = (walk.provenance, None, ()) if found else (walk.provenance, walk, ())
    status, plan = (Status.FOUND, walk) if found else (Status.NO_PATH, None)
    return WalkResult(status, plan, "" if found else "a leg is too short", (), walk.goal, *told)


def test_footfalls_are_numbered_in_their_order_and_name_their_leg(walk):
    [mark] = footfall_marks(walk)
    assert mark.text == f"1: leg {LEG}"
    np.testing.assert_allclose(mark.point, walk.stances[1].contacts[LEG] + (0, 0, OVER_GROUND))
    before, after = walk.stances
    further = replace(walk, legs=(LEG, 4, LEG), stances=(before, after, before, after))
    assert [one.text for one in footfall_marks(further)] == [f"1: leg {LEG}", "2: leg 4", f"3: leg {LEG}"]
    np.testing.assert_allclose(footfall_marks(further)[1].point, before.contacts[4] + (0, 0, OVER_GROUND))


def test_the_line_is_as_long_as_the_chassis_goes_and_stays_where_it_stays(walk):
    line = chassis_line(walk)
    lengths = np.linalg.norm(line[:, 1] - line[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(walk.chassis_way)
    assert lengths.min() > 0
    np.testing.assert_array_equal(line[0, 0], walk.Ts_site_base[0, :3, 3])
    np.testing.assert_array_equal(line[-1, 1], walk.Ts_site_base[-1, :3, 3])
    np.testing.assert_allclose(line[1:, 0], line[:-1, 1])
    still = replace(walk, Ts_site_base=np.repeat(walk.Ts_site_base[:1], len(walk.waypoints), axis=0))
    assert chassis_line(still).shape == (0, 2, 3)


def test_a_walk_that_does_not_arrive_says_so(walk):
    assert end_text(answer(walk, found=True)) == "walk: 1 foot move"
    assert end_text(answer(walk, found=False)) == "✕ it comes this far: 1 foot move"


def test_the_newest_walk_is_drawn_while_its_ground_is_there(tmp_path, monkeypatch, athlete, ground, stood, walk):
    pool = InlineJobs()
    made = {1: answer(walk, found=True), 2: answer(walk, found=False), 3: replace(answer(walk, False), partial=None)}
    recipes = {**PRODUCTS, "walk": lambda parents, asked, progress: made[asked.settings.seed]}
    monkeypatch.setattr(pool, "_recipes", recipes)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path, pool, robot=athlete) as sessions:
        live = sessions.create("walks")
        live.load_terrain(ground)
        live.set_state(stood)
        scene = Scene(server)
        scene.follow(live)

        def ask(seed):
            live.ask(WALK, WalkRequest(WalkGoal(0.5, 0.0), WalkSettings(seed=seed))).finish()

        def there(name, shown=True):
            return until(lambda: (server.scene.get_handle_by_name(name) is not None) == shown, f"{name}: {shown}")

        def text_of(name):
            label = server.scene.get_handle_by_name(name)
            return label.text if isinstance(label, viser.LabelHandle) else None

        def end_says(text):
            return until(lambda: text_of("/walk/end") == text, text)

        ask(1)
        assert all(there(name) for name in ("/walk/marks", "/walk/chassis", "/walk/1", "/walk/end"))
        assert end_says("walk: 1 foot move")
        ask(2)
        assert end_says("✕ it comes this far: 1 foot move")
        ask(3)
        assert there("/walk/end", shown=False)
        assert there("/walk/marks", shown=False)
        ask(1)
        assert there("/walk/marks")
        live.load_terrain(wavy(half=3.0))
        assert there("/walk/marks", shown=False)
        scene.close()
    server.stop()
