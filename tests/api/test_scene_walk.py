"""What is drawn of a walk: its footfalls with number and leg, the chassis' way, how far it comes."""

from dataclasses import replace

import numpy as np
import pytest
import viser

import footfall
from footfall.balance.tether import EDGE, Tether
from footfall.planning.answers import Status
from footfall.planning.gait.problem import GaitFailure, GaitResult
from footfall.planning.walk.problem import Tethered, WalkGoal, WalkResult, WalkSettings
from footfall.session.jobs.local import InlineJobs
from footfall.session.jobs.product_recipes import PRODUCTS
from footfall.session.jobs.requests import WalkRequest
from footfall.session.products.kinds import WALK
from footfall.session.registry import Sessions
from footfall_ui.scene import Scene
from footfall_ui.scene.failing import COLOR, failing_text
from footfall_ui.scene.tether import anchor_text, length_text, tether_line
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
    line = chassis_line(walk.Ts_site_base)
    lengths = np.linalg.norm(line[:, 1] - line[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(walk.chassis_way)
    assert lengths.min() > 0
    np.testing.assert_array_equal(line[0, 0], walk.Ts_site_base[0, :3, 3])
    np.testing.assert_array_equal(line[-1, 1], walk.Ts_site_base[-1, :3, 3])
    np.testing.assert_allclose(line[1:, 0], line[:-1, 1])
    still = replace(walk, Ts_site_base=np.repeat(walk.Ts_site_base[:1], len(walk.waypoints), axis=0))
    assert chassis_line(still.Ts_site_base).shape == (0, 2, 3)


def test_a_walk_that_does_not_arrive_says_so(walk):
    assert end_text(answer(walk, found=True)) == "walk: 1 foot move"
    assert end_text(answer(walk, found=False)) == "✕ it comes this far: 1 foot move"


def on_tether(walk, tether):
    """The walk as one that hangs on a tether, which pulls with nothing."""
    lengths = tether.lengths(walk.Ts_site_base)
    return replace(walk, tethered=Tethered(tether, np.array([0.0, 0.0, 1.0]), lengths, np.zeros(len(lengths))))


def test_the_tether_goes_from_its_anchor_to_the_chassis_where_the_ghost_is(walk):
    tether = Tether(np.array([-3.2, 1.9, 2.0]), np.array(EDGE))
    for moment, row in ((0.0, 0), (1.0, -1)):
        line = tether_line(walk, tether, moment)
        np.testing.assert_array_equal(line[0], tether.anchor)
        assert np.linalg.norm(line[1] - line[0]) == pytest.approx(float(tether.lengths(walk.Ts_site_base)[row]))
    tethered = on_tether(walk, tether).tethered
    first = float(tethered.lengths[0])
    assert length_text(tethered, first) == f"tether {first:.2f} m"
    assert length_text(tethered, first + 0.5) == f"tether {first + 0.5:.2f} m, 0.50 m paid out"
    assert length_text(tethered, first - 0.5) == f"tether {first - 0.5:.2f} m, 0.50 m hauled in"
    assert anchor_text(tether) == "anchor, at most 30 m and 12000 N"


def test_the_newest_walk_is_drawn_while_its_ground_is_there(tmp_path, monkeypatch, athlete, ground, stood, walk):
    pool = InlineJobs()
    made = {1: answer(walk, found=True), 2: answer(walk, found=False), 3: replace(answer(walk, False), partial=None)}
    made[4] = answer(on_tether(walk, Tether(np.array([-3.2, 1.9, 2.0]), np.array(EDGE))), found=True)
    recipes = {**PRODUCTS, "walk": lambda parents, asked, progress: made[asked.settings.seed]}
    monkeypatch.setattr(pool, "_recipes", recipes)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path, pool, robot=athlete) as sessions:
        live = sessions.create("walks")
        live.terrains.load(ground)
        live.stances.set(stood)
        scene = Scene(server)
        scene.follow(live)

        def ask(seed):
            live.stances.ask(WALK, WalkRequest(WalkGoal(0.5, 0.0), WalkSettings(seed=seed))).finish()

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
        ask(4)
        assert all(there(name) for name in ("/tether/line", "/tether/anchor", "/tether/length"))
        here = text_of("/tether/length")
        assert here is not None
        live.choices.set_view(show_ghost=True, scrub=0.0)
        assert until(lambda: text_of("/tether/length") not in (here, None), "the tether at the walk's start")
        ask(1)
        assert there("/tether/line", shown=False)
        assert there("/tether/anchor", shown=False)
        assert there("/walk/marks")
        live.terrains.load(wavy(half=3.0))
        assert there("/walk/marks", shown=False)
        scene.close()
    server.stop()


def test_a_gait_that_fails_stands_in_red_until_a_walk_is_planned(tmp_path, monkeypatch, athlete, ground, stood, walk):
    T = np.array(stood.T_site_base)
    T[0, 3] += 0.3
    failure = GaitFailure(2, (0, 2, 4), 4, "reach", 0.05, "m", 0.0, 0.0, np.array(stood.posture), T)
    assert failing_text(failure) == "✕ step 3 (legs 0, 2, 4) fails reach of leg 4 by 0.05 m, chassis at (0.00, 0.00)"
    told = ("reach", failure, 0.0, (), walk.goal, walk.provenance)
    pool = InlineJobs()
    made = {"gait": GaitResult(Status.NO_PATH, None, None, *told), "walk": answer(walk, found=True)}
    monkeypatch.setattr(pool, "_recipes", {**PRODUCTS, **{name: lambda *_, one=one: one for name, one in made.items()}})
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with Sessions(tmp_path, pool, robot=athlete) as sessions:
        live = sessions.create("gaits")
        live.terrains.load(ground)
        live.stances.set(stood)
        scene = Scene(server)
        scene.follow(live)

        def there(name, shown=True):
            return until(lambda: (server.scene.get_handle_by_name(name) is not None) == shown, f"{name}: {shown}")

        live.walks.plan_gait(walk.goal).finish()
        assert there("/failing-text")
        assert there("/failing/base")
        mesh, frame = (server.scene.get_handle_by_name(name) for name in ("/failing/base", "/failing"))
        assert isinstance(mesh, viser.BatchedMeshHandle)
        assert isinstance(frame, viser.FrameHandle)
        assert tuple(np.asarray(mesh.batched_colors)) == COLOR
        np.testing.assert_allclose(frame.position, T[:3, 3], atol=1e-6)
        live.walks.plan(walk.goal).finish()
        assert there("/failing-text", shown=False)
        assert there("/failing", shown=False)
        assert there("/walk/end")
        live.walks.plan_gait(walk.goal).finish()
        assert there("/failing-text")
        assert there("/walk/end", shown=False)
        scene.close()
    server.stop()
