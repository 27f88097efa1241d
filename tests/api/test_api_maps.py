"""Maps over REST: asked for with settings, read at a point, downloaded, and footfalls suggested on them."""

import io
import json

import numpy as np
import pytest
from rasterio.io import MemoryFile

from footfall.maps.layers import LAYERS, REACHABLE_STABLE
from footfall.maps.quality_settings import QualitySettings
from tests.support.jobs import finished, result
from tests.support.problems import problem

LEG = 2
SESSION = "/sessions/current"
BALANCE = {"friction": 0.8, "gravity": 3.71, "payload_mass": 50.0, "payload_position": [0.1, 0.0, 0.4], "sides": 8}
QUALITY = {"weights": {"slope": 3.0, "age": 0}, "ramps": {"slope": [0.3, 0.0]}, "lowest": -2.5}
# of footfalls alone: lifted from here, no leg leaves the others a conservative polygon with such a margin
FOOTFALLS = {"conservative": True, "stable_margin": 0.05, "lift_off": False}
SETTINGS = {**FOOTFALLS, "friction": True, "balance": BALANCE, "quality": QUALITY}


@pytest.fixture(scope="module")
def maps(standing):
    """Digest of maps of leg 2 with all layers."""
    return finished(standing, standing.post(f"{SESSION}/maps", json={"leg": LEG, "settings": SETTINGS}))["result"]


@pytest.fixture(scope="module")
def about(standing, maps):
    return standing.get(f"{SESSION}/maps/{maps}").json()


def cells(standing, maps, layer):
    return np.load(io.BytesIO(standing.get(f"{SESSION}/maps/{maps}/{layer}.npy").content))


def test_every_layer_is_listed_once_in_its_group(standing):
    groups = standing.get("/layers").json()["groups"]
    assert [group["title"] for group in groups] == ["Ground", "Leg", "Balance", "Footfall"]
    listed = [layer for group in groups for layer in group["layers"]]
    assert [layer["name"] for layer in listed] == list(LAYERS)
    for layer in listed:
        assert (layer["title"], layer["unit"]) == (LAYERS[layer["name"]].title, LAYERS[layer["name"]].unit)
        assert layer["text"]


def test_every_factor_of_quality_is_listed_with_the_weight_it_has_unless_given(standing):
    factors = standing.get("/layers").json()["factors"]
    assert {factor["name"]: factor["weight"] for factor in factors} == QualitySettings().weights
    assert all(factor["title"] and factor["text"] and factor["unit"] for factor in factors)
    assert len({factor["title"] for factor in factors}) == len(factors)


def test_nested_settings_reach_the_maps(about):
    assert about["stability"] == "conservative"
    settings = about["settings"]
    assert {name: settings["balance"][name] for name in BALANCE} == BALANCE
    assert settings["balance"]["slope"] == 0.0, "what is left out keeps its default"
    assert (settings["quality"]["weights"]["slope"], settings["quality"]["weights"]["support"]) == (3.0, 2.0)
    assert settings["quality"]["ramps"]["slope"] == [0.3, 0.0]
    assert (settings["stable_margin"], settings["lift"]) == (0.05, 0.2)
    assert set(about["layers"]) == set(LAYERS)
    for name, layer in about["layers"].items():
        assert layer["title"] == LAYERS[name].title
        assert layer["legend"]


def test_without_friction_there_are_no_layers_with_it(standing):
    made = result(standing, finished(standing, standing.post(f"{SESSION}/maps", json={"leg": LEG})))
    left_out = {"margin_friction", "margin_friction_conservative", "torque_ratio", "footing_friction"}
    assert set(LAYERS) - set(made["layers"]) == left_out
    problem(standing.get(f"{SESSION}/maps/{made['digest']}/torque_ratio.png"), 404, "not-found")


@pytest.mark.parametrize(
    "settings",
    [
        {"colour": 1},
        {"balance": {"colour": 1}},
        {"quality": {"colour": 1}},
        {"friction": 1},
        {"friction": "yes"},
        {"conservative": None},
        {"stable_margin": True},
        {"stable_margin": "0.1"},
        {"balance": {"friction": True}},
        {"balance": {"gravity": "moon"}},
        {"balance": {"sides": 8.5}},
        {"balance": {"payload_position": [0, 0, "0"]}},
        {"balance": {"payload_position": [0, 0, True]}},
        {"balance": None},
        {"quality": {"weights": {"slope": True}}},
        {"quality": {"weights": {"slope": "1"}}},
        {"quality": {"weights": [1.0]}},
        {"quality": {"ramps": {"slope": [0.3, False]}}},
        {"quality": {"ramps": {"slope": 0.3}}},
        {"quality": {"allow_unknown": 1}},
        {"stable_margin": float("nan")},
        {"balance": {"gravity": float("inf")}},
        {"balance": {"payload_position": [0.0, float("nan"), 0.0]}},
        {"quality": {"weights": {"slope": float("nan")}}},
        {"quality": {"ramps": {"slope": [float("-inf"), 0.0]}}},
    ],
    ids=json.dumps,
)
def test_what_is_no_setting_is_refused(standing, settings):
    body = json.dumps({"leg": LEG, "settings": settings})
    answer = standing.post(f"{SESSION}/maps", content=body, headers={"content-type": "application/json"})
    document = problem(answer, 422, "validation")
    names = [name for one in settings.items() for name in [one[0], *(one[1] if isinstance(one[1], dict) else ())]]
    assert all(name in answer.text for name in names), document


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"stable_margin": -1.0}, "stable_margin"),
        ({"balance": {"friction": -0.5}}, "friction"),
        ({"balance": {"gravity": 0}}, "gravity"),
        ({"balance": {"payload_mass": 1000.0}}, "payload"),
        ({"balance": {"payload_mass": 10.0, "payload_position": [0.0, 1.0]}}, "three"),
        ({"quality": {"weights": {"beauty": 1.0}}}, "beauty"),
        ({"quality": {"ramps": {"slope": [0.3]}}}, "slope"),
        ({"quality": {"ramps": {"slope": [0.3, 0.3]}}}, "slope"),
        ({"quality": {"lowest": 0.0, "highest": -1.0}}, "lowest"),
    ],
)
def test_settings_that_make_no_sense_are_refused(standing, settings, word):
    answer = standing.post(f"{SESSION}/maps", json={"leg": LEG, "settings": settings})
    assert word in problem(answer, 422, "invalid-input")["detail"]


def test_the_same_maps_again_are_there_at_once(standing, maps):
    count = len(standing.get(f"{SESSION}/log").json()["events"])
    again = standing.post(f"{SESSION}/maps", json={"leg": LEG, "settings": SETTINGS})
    assert again.status_code == 202
    assert (again.json()["state"], again.json()["result"]) == ("done", maps)
    assert again.json()["result_url"].endswith(f"/maps/{maps}")
    assert standing.get(again.headers["location"].removeprefix("/api/v1")).json() == again.json()
    (event,) = standing.get(f"{SESSION}/log").json()["events"][count:]
    assert (event["type"], event["payload"]["digest"]) == ("product", maps)


def test_a_point_is_read_out(standing, maps, about):
    grid = about["geometry"]
    footing = cells(standing, maps, "footing_friction")
    row, col = (int(i[0]) for i in np.nonzero(footing == REACHABLE_STABLE))
    x, y = grid["x0"] + col * grid["resolution"], grid["y0"] + row * grid["resolution"]
    told = standing.get(f"{SESSION}/maps/{maps}/at", params={"x": x + 0.02, "y": y - 0.02}).json()
    assert (told["row"], told["col"]) == (row, col)
    assert told["score"] == pytest.approx(float(cells(standing, maps, "quality")[row, col]), abs=1e-6)
    assert told["verdict"].startswith("acceptable")
    lines = "\n".join(told["lines"])
    for word in ("slope", "margin", "footing reachable and stable", "torque ratio", "height"):
        assert word in lines
    corner = standing.get(f"{SESSION}/maps/{maps}/at", params={"x": grid["x0"], "y": grid["y0"]}).json()
    assert corner["verdict"].startswith("refused")
    assert (corner["score"], corner["refused"] > 0) == (0.0, True)


def test_a_point_that_is_none_is_refused(standing, maps):
    path = f"{SESSION}/maps/{maps}/at"
    assert "outside" in problem(standing.get(path, params={"x": 90, "y": 0}), 422, "invalid-input")["detail"]
    problem(standing.get(path, params={"x": "nan", "y": 0}), 422, "validation")
    problem(standing.get(path, params={"x": "east", "y": 0}), 422, "validation")
    problem(standing.get(path, params={"x": 1}), 422, "validation")
    problem(standing.get(f"{SESSION}/maps/{'0' * 32}/at", params={"x": 0, "y": 0}), 404, "not-found")
    state = standing.get(f"{SESSION}").json()["state"]
    assert "not a MapStack" in problem(standing.get(f"{SESSION}/maps/{state}"), 404, "not-found")["detail"]


def suggested(standing, **order):
    answer = standing.post(f"{SESSION}/suggestions", json={"leg": LEG, **order})
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_suggestions_are_ranked_apart_and_say_why(standing, maps):
    found = suggested(standing, count=4, separation=0.4)
    footing, quality = cells(standing, maps, "footing_friction"), cells(standing, maps, "quality")
    best = found["footfalls"]
    assert len(best) == 4
    scores = [one["score"] for one in best]
    assert scores == sorted(scores, reverse=True)
    assert scores[0] == pytest.approx(float(np.nanmax(quality)), abs=1e-6)
    for i, one in enumerate(best):
        assert footing[one["row"], one["col"]] == REACHABLE_STABLE
        assert one["reasons"]
        assert one["factors"].keys() == one["amounts"].keys()
        assert all(np.hypot(one["x"] - other["x"], one["y"] - other["y"]) >= 0.4 - 1e-9 for other in best[:i])
    assert "advance" in found["left_out"], "without a goal nothing advances"
    assert sum(found["refused"].values()) == np.count_nonzero(quality == 0)


def test_suggestions_lie_a_wheel_apart_and_each_says_what_sets_it_apart(standing, maps):
    wheel = 2 * standing.get("/robot").json()["wheel_radius"]
    best = suggested(standing, count=5)["footfalls"]
    places = [(one["x"], one["y"]) for one in best]
    assert len(best) == 5
    assert min(np.hypot(x - a, y - b) for i, (x, y) in enumerate(places) for a, b in places[:i]) >= wheel - 1e-9
    told = [one["apart"] for one in best]
    assert len({(one["measure"], one["rank"]) for one in told}) == 5
    margins = cells(standing, maps, "margin_friction_conservative")
    for one, apart in zip(best, told, strict=True):
        if apart["measure"] == "margin":
            assert apart["amount"] == pytest.approx(float(margins[one["row"], one["col"]]))
    # more than have room: the rest lie nearer, and that is told
    many = suggested(standing, count=50)
    assert len(many["footfalls"]) == 50
    assert "the others are nearer" in many["reason"]


def test_a_goal_direction_moves_the_best_footfall(standing, maps):
    west, east = (suggested(standing, count=1, towards=[dx, 0.0])["footfalls"][0] for dx in (-1.0, 1.0))
    assert west["x"] < east["x"]
    assert {"advance"} <= set(west["factors"])
    weighted = suggested(standing, count=1, towards=[1.0, 0.0], settings={"weights": {"advance": 50.0}})
    assert weighted["footfalls"][0]["x"] >= east["x"]


def test_suggestions_that_can_not_be_made(standing, maps):
    path = f"{SESSION}/suggestions"
    assert "no maps of leg 3" in problem(standing.post(path, json={"leg": 3}), 409, "conflict")["detail"]
    problem(standing.post(path, json={"leg": LEG, "towards": [0.0, 0.0]}), 422, "invalid-input")
    problem(standing.post(path, json={"leg": 9}), 422, "invalid-input")
    for wrong in (
        {"count": 0},
        {"count": 51},
        {"count": True},
        {"separation": -0.1},
        {"towards": [1.0]},
        {"settings": {"weights": {"slope": True}}},
        {"why": 1},
    ):
        problem(standing.post(path, json={"leg": LEG, **wrong}), 422, "validation")
    # nothing is good enough: an answer, with the reason
    none = suggested(standing, settings={"lowest": -0.01, "highest": 0.0})
    assert none["footfalls"] == []
    assert "widen the elevation band" in none["reason"]


def test_the_geotiff_holds_every_layer(standing, maps, about):
    answer = standing.get(f"{SESSION}/maps/{maps}.tif")
    assert answer.headers["content-type"] == "image/tiff"
    assert f"maps-leg2-{maps[:8]}.tif" in answer.headers["content-disposition"]
    grid = about["geometry"]
    with MemoryFile(answer.content) as memory, memory.open() as file:
        assert file.shape == (grid["rows"], grid["cols"])
        assert json.loads(file.tags()["FOOTFALL"]) == {"leg": LEG, "stability": "conservative", "digest": maps}
        # the middle of the north-western cell
        assert file.xy(0, 0) == pytest.approx((grid["x0"], grid["y0"] + (grid["rows"] - 1) * grid["resolution"]))
        names = [description.split(" [")[0] for description in file.descriptions]
        assert names == list(about["layers"])
        for band, name in enumerate(names, 1):
            north_up = cells(standing, maps, name)[::-1].astype(np.float32)
            np.testing.assert_array_equal(file.read(band), north_up, err_msg=name)
    problem(standing.get(f"{SESSION}/maps/{'0' * 32}.tif"), 404, "not-found")


def test_the_openapi_document_lists_what_is_there(standing):
    document = standing.get("/openapi.json").json()
    base = "/api/v1"
    one = f"{base}/sessions/{{session}}"
    for path, method in (
        (f"{base}/layers", "get"),
        (f"{one}/maps", "post"),
        (f"{one}/maps/{{digest}}", "get"),
        (f"{one}/maps/{{digest}}.tif", "get"),
        (f"{one}/maps/{{digest}}/at", "get"),
        (f"{one}/suggestions", "post"),
        (f"{one}/what-if", "put"),
        (f"{one}/what-if", "delete"),
        (f"{one}/shifts", "post"),
        (f"{one}/shifts/{{digest}}", "get"),
        (f"{one}/body-moves", "post"),
        (f"{one}/body-moves/{{digest}}", "get"),
        (f"{one}/held-moves", "post"),
        (f"{one}/held-moves/{{digest}}", "get"),
    ):
        assert method in document["paths"][path], path
    schemas = document["components"]["schemas"]
    assert {"MapSettings", "BalanceSettings", "QualitySettings", "BodyShift", "WhatIfOrder"} <= set(schemas)
    assert schemas["MapSettings"]["properties"]["balance"]["$ref"].endswith("/BalanceSettings")
    assert schemas["QualitySettings"]["additionalProperties"] is False
