"""Which columns of a text are x, y and z, whether all of it is there; whole numbers of depth images."""

import io
from typing import Any

import numpy as np
import pytest

from footfall.core.errors import InvalidTerrain
from footfall.io.depth_files import read_depth
from footfall.io.scan_files import read_scan

POINTS = [[1.0, 2.0, 3.0], [4.0, 5.0, 7.0]]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", "1 2 3\n4 5 7\n"),
        ("a.xyz", "# id x y z\n9 1 2 3\n8 4 5 7\n"),
        ("a.csv", "#z,x,y\n3,1,2\n7,4,5\n"),
        ("a.csv", "//X,Y,Z,Intensity\n1,2,3,9\n4,5,7,9\n"),
        ("a.csv", "# t x y z\n9,1,2,3\n9,4,5,7\n"),
        ("a.txt", "% made by x y z\n1 2 3\n4 5 7\n"),
        ("a.txt", "# x y z\n# of May\n1 2 3\n4 5 7\n"),
        ("a.txt", "2\n1 2 3\n4 5 7\n"),
        ("a.txt", "//id X Y Z\n2\n9 1 2 3\n8 4 5 7\n"),
        ("a.txt", "2\n# z x y\n3 1 2\n7 4 5\n"),
        ("a.txt", "2\nx y z\n1 2 3\n4 5 7\n"),
        ("a.csv", "lat,lon,x,y,z\n46,7,1,2,3\n46,7,4,5,7\n"),
        ("a.xyz", "# northing easting height\n2 1 3\n5 4 7\n"),
        ("a.csv", "# Northing,Easting,Elevation\n2,1,3\n5,4,7\n"),
        ("a.csv", "Northing;Easting;Elevation\n2;1;3\n5;4;7\n"),
        ("a.xyz", "# N E U\n# in May\n2 1 3\n5 4 7\n"),
        ("a.xyz", "# northing [m] easting [m] height [m]\n2 1 3\n5 4 7\n"),
        ("a.xyz", "x (m) y (m) z (m) i t\n1 2 3 9 8\n4 5 7 9 8\n"),
        ("a.csv", '"x [m]","y [m]","z [m]"\n1,2,3\n4,5,7\n'),
        ("a.xyz", "# y x height\n2 1 3\n5 4 7\n"),
        ("a.xyz", "# height x y\n3 1 2\n7 4 5\n"),
        ("a.xyz", "# x y intensity height\n1 2 9 3\n4 5 9 7\n"),
        ("a.csv", "x,y,z,height\n1,2,3,9\n4,5,7,9\n"),
        ("a.xyz", "# x y value\n1 2 3\n4 5 7\n"),
        ("a.xyz", "# made by ALS\n1 2 3\n4 5 7\n"),
        ("a.csv", "x,y,z\n1,2,3,\n4,5,7, \n"),
        ("a.xyz", "x y z what\n1 2 3 tree top\n4 5 7 ground # by hand, at noon\n"),
    ],
)
def test_what_a_heading_calls_the_columns_they_are_in_a_comment_too(name, text):
    np.testing.assert_array_equal(read_scan(text.encode(), name).points, POINTS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x,y,z,z\n1,2,3,4\n", "has z twice: x, y, z, z"),
        ("X,x,y,z\n1,2,3,4\n", "has x twice"),
        ("# x,y,z,z\n1,2,3,4\n", "has z twice"),
        ("3\n1 2 3\n4 5 6\n", "it states 3 points and holds 2"),
        ("-1,5;-2,5;-3,5\n", "line 1, column 1 .x. has '-1,5', which is no number; write a point: -1.5"),
        ("0,1,2,3\n1,4,5,7\n2,5,5,7\n", "first of the 4 columns of a.csv counts the rows, from 0 to 2,.*id,x,y,z"),
        ("# y x intensity\n1 2 3\n4 5 6\n", "begins with y, x, intensity: .*east, north and height.*none for z"),
        ("# north east down\n1 2 3\n4 5 6\n", "begins with north, east, down: .* none for z"),
        ("# x y depth\n1 2 3\n4 5 6\n", "begins with x, y, depth: .* none for z"),
        ("east,north,up,h\n1,2,3,4\n", "has z twice: east, north, up, h"),
        ("x y z\n1 7.5 2.5 3.5\n2 8.5 2.5 3.5\n", "line 2 has 4 columns and its heading 3, .* which is x"),
        ("x y z class\n1 7.5 2.5 3.5 ground\n", "line 2 has 5 columns and its heading 4"),
        ("x,y,z\n0,0,0\n1,5,2,5,3,5\n", "line 3 has 6 columns and its heading 3, .*a point where a comma"),
        ("1,5,2,5,3,5\n1,05,2,5,3,5\n2,5,2,5,3,5\n", "line 2 has '05' behind its first comma, .*write a point"),
        ("# lon lat height\n7.5 46.1 500\n7.6 46.2 510\n", "calls its first columns lon, lat, height: reproject"),
    ],
)
def test_what_is_twice_cut_or_on_the_globe_is_refused(text, words):
    with pytest.raises(InvalidTerrain, match=words):
        read_scan(text.encode(), "a.csv")


def test_a_first_column_that_counts_rows_is_x_where_a_heading_says_so_or_there_is_no_other():
    rows = [[1.0, 2.0, 3.0], [2.0, 5.0, 7.0], [3.0, 6.0, 7.0]]
    for text in ("1 2 3\n2 5 7\n3 6 7\n", "x,y,z,i\n1,2,3,9\n2,5,7,9\n3,6,7,9\n"):
        np.testing.assert_array_equal(read_scan(text.encode(), "a.csv").points, rows)


def test_a_ply_that_calls_its_coordinates_otherwise_is_told_so():
    head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty double X\nproperty double y\nproperty double z\n"
    with pytest.raises(InvalidTerrain, match=r"a\.ply has no property x; the points of a PLY are x, y and z"):
        read_scan(f"{head}end_header\n1 2 3\n".encode(), "a.ply")


def test_whole_numbers_of_depth_are_counts_that_need_a_scale():
    """Millimetres of 16 bit were metres: ground a thousand times as far."""
    held = io.BytesIO()
    members: dict[str, Any] = {"focal_length": 100.0, "cx": 1.0, "cy": 1.0}
    np.savez(held, depth=np.full((2, 2), 1500, np.uint16), **members)
    with pytest.raises(InvalidTerrain, match="whole numbers depth_scale"):
        read_depth(held.getvalue(), "a.npz")
    assert read_depth(held.getvalue(), "a.npz", {"depth_scale": 0.001}).points[:, 2].max() == 1.5
