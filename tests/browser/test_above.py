"""How the map from above lies in its picture: laws over many views, by the page's own module; without a browser."""

import numpy as np
import pytest

from tests.browser.test_next_thing import of_page

SCRIPT = """
    const above = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    console.log(JSON.stringify(asked.map(([name, ...given]) => above[name](...given))));
"""
DASHES = """
    const { paintMarks } = await import(process.argv[1]);
    const asked = JSON.parse(await new Response(process.stdin).text());
    const dashed = ([robot, age_s]) => {
        const found = [];
        const take = (name) => (one) => { if (name === "setLineDash") found.push(one); };
        const pen = new Proxy({}, { set: () => true, get: (_, name) => take(name) });
        const T_site_base = [[1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 1, 1], [0, 0, 0, 1]];
        const summary = { up_to_date: {}, walking: null, gate: { state: "idle" }, view: {}, footfall: null };
        const frame = { T_site_base, age_s, heardAt: performance.now() };
        const facts = { summary, robot, walk: null, route: null, frame };
        paintMarks(pen, (at) => at, facts, { forbidden: [], pinned: [] }, []);
        return found.some((one) => one.length > 0);
    };
    console.log(JSON.stringify(asked.map(dashed)));
"""
"""Whether the rover's mark is dashed, of robots with telemetry of some age [s]."""
SEEN = 60
"""Views that are tried."""


def of_module(asked: list[list]) -> list:
    return of_page(SCRIPT, "above.js", asked)


@pytest.fixture(scope="module")
def views() -> list[tuple[dict, dict, list[float]]]:
    """How a map lies, the size of its picture, a pixel of it; by a fixed seed."""
    rng = np.random.default_rng(5)
    made = []
    for _ in range(SEEN):
        x, y = rng.uniform(-500, 500, 2)
        width, height = rng.uniform(100, 2000, 2)
        lie = {"x": x, "y": y, "scale": float(np.exp(rng.uniform(np.log(1), np.log(2000))))}
        made.append((lie, {"width": width, "height": height}, [rng.uniform(0, width), rng.uniform(0, height)]))
    return made


def test_north_is_up_and_a_place_comes_back_from_its_pixel(views):
    places = of_module([["toSite", *view] for view in views])
    back = of_module([["toPixel", lie, size, at] for (lie, size, _), at in zip(views, places, strict=True)])
    assert np.array(back) == pytest.approx(np.array([pixel for _, _, pixel in views]), abs=1e-6)
    ahead = of_module(
        [
            ["toPixel", lie, size, [at[0] + 1 / lie["scale"], at[1] + 2 / lie["scale"]]]
            for (lie, size, _), at in zip(views, places, strict=True)
        ]
    )
    assert np.subtract(ahead, back) == pytest.approx(np.tile([1.0, -2.0], (SEEN, 1)), abs=1e-6)


def test_what_is_zoomed_about_stays_and_what_is_dragged_goes_along(views):
    before = of_module([["toSite", *view] for view in views])
    for by in (1.5, 0.01, 1e9):
        nearer = of_module([["zoomed", lie, size, by, pixel] for lie, size, pixel in views])
        after = of_module([["toSite", lie, size, pixel] for lie, (_, size, pixel) in zip(nearer, views, strict=True)])
        assert np.array(after) == pytest.approx(np.array(before), abs=1e-6)
        assert all(0.5 <= lie["scale"] <= 4000 for lie in nearer)
    moved = of_module([["moved", lie, [30, -7]] for lie, _, _ in views])
    shown = [
        ["toSite", lie, size, [pixel[0] + 30, pixel[1] - 7]] for lie, (_, size, pixel) in zip(moved, views, strict=True)
    ]
    assert np.array(of_module(shown)) == pytest.approx(np.array(before), abs=1e-6)


def test_all_of_the_ground_fits_and_fills_the_picture():
    rng = np.random.default_rng(6)
    for _ in range(10):
        west, south = rng.uniform(-100, 100, 2)
        wide, high, width, height = rng.uniform(2, 60, 2).tolist() + rng.uniform(150, 900, 2).tolist()
        bounds = {"west": west, "south": south, "east": west + wide, "north": south + high}
        size = {"width": width, "height": height}
        (lie,) = of_module([["fitted", bounds, size]])
        corners = np.array(
            of_module([["toPixel", lie, size, [x, y]] for x in (west, west + wide) for y in (south, south + high)])
        )
        assert (corners > 0).all()
        assert (corners < [width, height]).all()
        assert max(np.ptp(corners, axis=0) / [width, height]) == pytest.approx(0.92)


def test_the_bar_is_the_longest_round_length_that_has_room(views):
    most = 120
    round_lengths = np.array([digit * 10.0**power for power in range(-6, 7) for digit in (1, 2, 5)])
    scales = [lie["scale"] for lie, _, _ in views] + [0.12, 1.2, 120.0, 1200.0, 0.5, 60.0]
    told = of_module([["barOf", {"scale": scale}, most] for scale in scales])
    for scale, length in zip(scales, told, strict=True):
        fits = round_lengths[round_lengths * scale <= most * (1 + 1e-12)]
        assert length == pytest.approx(fits.max())


def test_a_rover_that_is_not_heard_is_dashed_whoever_described_it():
    square = [[[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]] for x in (1, -1) for y in (1, -1)]
    athletes, another = ({"T_base_hips": hips, "legs": [0, 1, 2, 3]} for hips in (square, []))
    asked = [[athletes, 0.1], [athletes, 30.0], [another, 0.1], [another, 30.0]]
    assert of_page(DASHES, "abovemarks.js", asked) == [False, True, False, True]
