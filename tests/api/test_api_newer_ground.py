"""Over REST: what a change of the ground leaves of the maps of a leg, in the summary and as stripes over layers."""

import io

import numpy as np
import pytest
from PIL import Image

from tests.support.jobs import finished

LEG = 2
SESSION = "/sessions/current"
CORNER = [-3.8, -3.8]
RADIUS = 0.2


@pytest.fixture(scope="module")
def maps(standing):
    return finished(standing, standing.post(f"{SESSION}/maps", json={"leg": LEG}))["result"]


def told(standing):
    return standing.get(SESSION).json()["up_to_date"]["maps"][str(LEG)]


def stripes(standing, maps, **asked):
    """Cells, row 0 south, that are not clear."""
    answer = standing.get(f"{SESSION}/maps/{maps}/changed.png", params=asked)
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png"), answer.text
    return np.array(Image.open(io.BytesIO(answer.content)).convert("RGBA"))[::-1, :, 3] > 0


def test_a_changed_corner_is_told_and_striped_until_it_is_undone(standing, maps):
    grid = standing.get(f"{SESSION}/maps/{maps}").json()["geometry"]
    assert not stripes(standing, maps).any()
    fit = told(standing)
    assert (fit["fits"], fit["partly"], fit["ground"]) == (True, False, None)
    assert standing.get(SESSION).json()["up_to_date"]["unheard"] == "the rover has sent no telemetry yet"
    assert fit["verdict"] == "unknown"

    cleared = standing.post(f"{SESSION}/terrains/clear", json={"center": CORNER, "radius": RADIUS})
    assert cleared.status_code < 300, cleared.text
    fit = told(standing)
    assert (fit["fits"], fit["verdict"], fit["partly"]) == (False, "differs", True)
    assert fit["ground"]["area"] == pytest.approx(np.pi * RADIUS**2, rel=0.3)
    assert "became known or unknown" in fit["reason"]
    away = np.hypot(
        *np.meshgrid(
            *(
                grid[start] + grid["resolution"] * np.arange(grid[count]) - middle
                for start, count, middle in (("x0", "cols", CORNER[0]), ("y0", "rows", CORNER[1]))
            )
        )
    )
    marked = stripes(standing, maps, layer="footing")
    assert marked[away <= RADIUS].all()
    assert not marked[away > 1.5].any()
    assert stripes(standing, maps, layer="age").all()
    chosen = {"leg": LEG, "x": CORNER[0] + RADIUS + 0.2, "y": CORNER[1]}
    answer = standing.post(f"{SESSION}/footfalls", json=chosen).json()
    assert answer["maps_current"] is False
    assert any("the terrain has changed since" in reason for reason in answer["reasons"])

    assert standing.post(f"{SESSION}/terrains/undo").status_code < 300
    assert told(standing)["fits"]
    assert not stripes(standing, maps).any()


def test_maps_that_are_not_the_latest_are_striped_all_over(standing, maps):
    newer = finished(standing, standing.post(f"{SESSION}/maps", json={"leg": LEG, "settings": {"stable_margin": 0.1}}))
    assert stripes(standing, maps).all()
    assert not stripes(standing, newer["result"]).any()
