"""Coordinates with six digits, as ``%g`` writes them: far from the origin neighbours fall onto one place."""

from typing import Any

import numpy as np
import pytest

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import decode_terrain

COUNT = 30
UTM = (500_000.3, 4_123_460.2)


def grid(spacing, place=UTM):
    x, y = (a.ravel() * spacing for a in np.meshgrid(np.arange(COUNT), np.arange(COUNT)))
    return np.column_stack([x + place[0], y + place[1], 100.0 + 0.3 * np.sin(x) + 0.1 * y])


def rows(points, form):
    return [" ".join(form % number for number in row) for row in points]


def faces():
    corners = np.arange(COUNT**2).reshape(COUNT, COUNT)
    a, b, c, d = (corners[i : COUNT - 1 + i, j : COUNT - 1 + j].ravel() for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


Made = tuple[bytes, str, dict[str, Any]]


def xyz(points, form) -> Made:
    return "\n".join(rows(points, form)).encode(), "a.xyz", {"unit": "m", "up": "z"}


def csv(points, form) -> Made:
    return "\n".join(["x,y,z", *rows(points, form)]).replace(" ", ",").encode(), "a.csv", {"unit": "m", "up": "z"}


def pcd(points, form) -> Made:
    head = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\n"
    head += f"WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA ascii\n"
    return (head + "\n".join(rows(points, form)) + "\n").encode(), "a.pcd", {"unit": "m", "up": "z"}


def obj(points, form) -> Made:
    lines = ["v " + row for row in rows(points, form)] + ["f {} {} {}".format(*(f + 1)) for f in faces()]
    return "\n".join(lines).encode(), "a.obj", {}


def off(points, form) -> Made:
    lines = ["OFF", f"{len(points)} {len(faces())} 0", *rows(points, form), *("3 {} {} {}".format(*f) for f in faces())]
    return "\n".join(lines).encode(), "a.off", {}


def ply(points, form) -> Made:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {len(faces())}\nproperty list uchar int vertex_indices\nend_header\n"
    return (head + "\n".join([*rows(points, form), *("3 {} {} {}".format(*f) for f in faces())])).encode(), "a.ply", {}


WRITERS = (xyz, csv, pcd, obj, off, ply)


@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize("spacing", [0.1, 0.5])
def test_six_digits_far_away_are_refused_with_their_step(write, spacing):
    content, name, options = write(grid(spacing), "%g")
    with pytest.raises(InvalidTerrain, match=r"in steps of 10? at \d+ from the origin, and \d+% of its points lie"):
        decode_terrain(content, name, **options)
    for form, place in (("%.9g", UTM), ("%g", (0.3, 0.2)), ("%g", (5_000.3, 900.2))):
        content, name, options = write(grid(spacing, place), form)
        assert np.isfinite(decode_terrain(content, name, resolution=spacing, **options).heights).mean() > 0.9


def test_all_points_on_one_place_are_refused():
    content, name, options = xyz(grid(0.1, (1_234_570.1, 2_234_560.3)), "%g")
    with pytest.raises(InvalidTerrain, match="in steps of 10 at"):
        decode_terrain(content, name, **options)


def test_a_map_of_whole_metres_far_away_is_read():
    """Where points are a metre apart, no digits are lost: nothing lies over another."""
    for write in WRITERS:
        content, name, options = write(grid(1.0, (500_000.0, 123_460.0)), "%.9g")
        assert decode_terrain(content, name, resolution=1.0, **options).geometry.resolution == 1.0


def test_a_step_in_feet_is_told_in_metres():
    content, name, _ = xyz(grid(0.5), "%g")
    with pytest.raises(InvalidTerrain, match="in steps of 10 at") as refused:
        decode_terrain(content, name, unit="ft", up="z")
    assert refused.value.details["step"] == pytest.approx(3.048)


def test_boxes_in_whole_metres_near_the_origin_are_read():
    """Corners of walls lie over each other, and no digits are lost."""
    corners = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 4 0 1\nv 8 0 1\nv 8 4 1\nv 4 4 1\n"
    made = f"{corners}f 1 2 3 4\nf 5 6 7 8\nf 2 5 8 3\n"
    assert decode_terrain(made.encode(), "a.obj", most_error=2.0).heights.max() == 1.0


def test_the_place_of_an_ascii_grid_needs_its_digits():
    made = "ncols 2\nnrows 2\nxllcorner {}\nyllcorner {}\ncellsize 0.5\n0 0 0 0\n"
    with pytest.raises(InvalidTerrain, match=r"yllcorner as 4.12346e\+06, to 10 m, coarser than its cells of 0.5 m"):
        decode_terrain(made.format(500000, "4.12346e+06").encode(), "a.asc")
    for place in ("4123460", "4123463.2", "4.123463200e+06", "5e5", "1.5e+01"):
        assert decode_terrain(made.format(500000, place).encode(), "a.asc").geometry.y0 == float(place) + 0.25


def scattered(place, count=900):
    """Points of smooth ground at no round places, and the faces of a grid of them."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(COUNT) * 0.2, np.arange(COUNT) * 0.2))
    x, y = (a + np.random.default_rng(3).uniform(0.0, 0.09, (2, count))[i] for i, a in enumerate((x, y)))
    return np.column_stack([x + place[0], y + place[1], 100.0 + 0.1 * np.sin(x)])


def held_by_32_bits(points):
    return points.astype(np.float32).astype(np.float64)


@pytest.mark.parametrize("form", ["%.9g", "%.3f", "%.6f"])
@pytest.mark.parametrize("place", [(500_000.3, 5_180_000.2), (700_000.3, 400_000.2), (-300_000.3, 12.0)])
def test_text_of_numbers_that_had_32_bits_is_refused_far_away(place, form):
    """More digits don't bring back what 32 bits had lost: northings were in steps of half a metre."""
    for write in WRITERS:
        if (write, form) == (pcd, "%.9g"):
            continue  # the same, to its own digits
        for points, taken in ((scattered(place), True), (held_by_32_bits(scattered(place)), False)):
            content, name, options = write(points, form)
            if taken:
                assert np.isfinite(decode_terrain(content, name, resolution=0.2, **options).heights).mean() > 0.5
                continue
            with pytest.raises(InvalidTerrain, match="keeps seven digits"):
                decode_terrain(content, name, resolution=0.2, **options)


def test_text_of_numbers_that_had_32_bits_is_read_where_these_have_digits_enough():
    for place in ((3_000.3, 900.2), (0.0, 0.0), (70_000.0, 100.0)):
        content, name, options = xyz(held_by_32_bits(scattered(place)), "%.9g")
        assert decode_terrain(content, name, resolution=0.2, **options).geometry.rows > 20


@pytest.mark.parametrize("spacing", [0.0625, 0.125, 0.25, 0.5])
def test_maps_in_steps_of_a_power_of_two_are_read_far_away(spacing):
    """Cells of an eighth of a metre about the middle of a map: all are numbers that 32 bits hold, at 500 km."""
    for offset in (0.0, 0.5 * spacing):
        content, name, options = xyz(grid(spacing, (500_000.0 + offset, 4_123_460.0 + offset)), "%.9f")
        assert decode_terrain(content, name, resolution=spacing, **options).geometry.resolution == spacing
