"""Systems of coordinates of every kind, by one check for grids, meshes and scans: metres, directions, the globe."""

import io
from typing import Any

import laspy
import numpy as np
import pytest
import rasterio
from laspy.vlrs.known import (
    GeoAsciiParamsVlr,
    GeoDoubleParamsVlr,
    GeoKeyDirectoryVlr,
    GeoKeyEntryStruct,
    WktCoordinateSystemVlr,
)
from PIL import Image
from rasterio.crs import CRS
from rasterio.io import MemoryFile
from rasterio.transform import Affine
from rasterio.warp import transform

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import decode_terrain, read_terrain, write_terrain
from footfall.io.terrain_projection import convergence
from footfall.terrain.from_arrays import from_heights

SIDE = 8
HEIGHTS = np.tile(np.float32(0.01) * np.arange(SIDE, dtype=np.float32), (SIDE, 1))
BASE = 'BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]]]'
MERCATOR = 'CONVERSION["m",METHOD["Popular Visualisation Pseudo Mercator"],PARAMETER["Longitude of natural origin",0]]'
UPRIGHT = 'AXIS["(E)",east,{0}],AXIS["(N)",north,{0}],AXIS["ellipsoidal height (h)",up,{0}]'.format(
    'LENGTHUNIT["metre",1]'
)
TOWGS84 = "+proj={} +ellps=bessel +towgs84=598,73,418 +units=m +no_defs"
SHIFT = 'DERIVINGCONVERSION["a",METHOD["Affine parametric transformation"],PARAMETER["A1",2],PARAMETER["B2",2]]'
DERIVED = (
    f'DERIVEDPROJCRS["d",BASEPROJCRS["b",{BASE},{MERCATOR}],{SHIFT},CS[Cartesian,2],AXIS["x",east],AXIS["y",north],'
)
DERIVED += 'LENGTHUNIT["metre",1]]'
LOCAL = 'ENGCRS["s",EDATUM["s"],CS[Cartesian,2],AXIS["x",{}],AXIS["y",{}],LENGTHUNIT["metre",1]]'

REFUSED = [
    ("depths below the sea", "EPSG:32633+5715", 700_000, 5_180_000, "depths"),
    ("depths in feet", "EPSG:32633+6358", 700_000, 5_180_000, "depths"),
    ("axes south and west", "EPSG:5513", 1_000_000, 600_000, "mirrored"),
    ("derived from a projection", DERIVED, 0, 5_180_000, "derived"),
    ("bound to another datum", TOWGS84.format("merc"), 0, 8_000_000, "not true to scale"),
    (
        "three dimensions",
        f'PROJCRS["x",{BASE},{MERCATOR},CS[Cartesian,3],{UPRIGHT}]',
        0,
        8_000_000,
        "not true to scale",
    ),
    ("off the globe", "EPSG:32633", 90_000_000, 90_000_000, "no ground, such as"),
    ("local, turned", LOCAL.format("west", "south"), 0, 0, "west and south"),
]


def files(folder, system, x, y):
    """The same ground as a GeoTIFF, as an ASCII grid, as a mesh and as a scan, and what a scan needs to be said."""
    crs = CRS.from_user_input(system)
    dem = from_heights(HEIGHTS, 0.5, x, y)
    for ending in ("asc", "obj"):
        write_terrain(dem, folder / f"a.{ending}")
        yield folder / f"a.{ending}", {}
    across, along = np.meshgrid(dem.geometry.xs, dem.geometry.ys)
    np.savetxt(folder / "a.xyz", np.column_stack([across.ravel(), along.ravel(), HEIGHTS.ravel()]), fmt="%.3f")
    yield folder / "a.xyz", {"up": "z", "resolution": 0.5}
    (folder / "a.prj").write_text(crs.to_wkt(version="WKT2_2019"))
    profile = {"driver": "GTiff", "width": SIDE, "height": SIDE, "count": 1, "dtype": "float32", "crs": crs}
    if not crs.to_wkt().startswith("LOCAL_CS"):  # GeoTIFF forgets how these run
        (folder / "apart").mkdir()
        path = folder / "apart" / "a.tif"
        place = Affine(0.5, 0, x - 0.25, 0, -0.5, y + 0.5 * (SIDE - 0.5))
        with rasterio.open(path, "w", **profile, transform=place) as target:
            target.write(HEIGHTS[::-1], 1)
        yield path, {}


@pytest.mark.parametrize(("what", "system", "x", "y", "words"), REFUSED, ids=[one[0] for one in REFUSED])
def test_no_system_is_refused_in_one_kind_of_file_and_taken_in_another(tmp_path, what, system, x, y, words):
    for path, arguments in [*files(tmp_path, system, x, y)]:
        with pytest.raises(InvalidTerrain, match=words):
            read_terrain(path, **arguments)


@pytest.mark.parametrize(
    ("system", "x", "y"),
    [
        (TOWGS84.format("utm +zone=33"), 700_000, 5_180_000),
        ("EPSG:27572", 900_000, 2_200_000),  # geographic part in grads, from Paris
        ("EPSG:2053", -50_000, 3_000_000),  # axes west and south: turned by half a turn
    ],
)
def test_true_north_is_that_of_the_meridian_in_every_kind_of_file(tmp_path, system, x, y):
    crs = CRS.from_user_input(system)
    # second method: walk a little to the north on the globe
    (lon,), (lat,), *_ = transform(crs, CRS.from_epsg(4326), [x + 1.75], [y + 1.75])
    xs, ys, *_ = transform(CRS.from_epsg(4326), crs, [lon, lon], [lat - 1e-4, lat + 1e-4])
    turned = np.degrees(np.arctan2(xs[1] - xs[0], ys[1] - ys[0]))
    for path, arguments in [*files(tmp_path, system, x, y)]:
        found = read_terrain(path, **arguments).true_north
        assert found is not None
        assert found[0] == pytest.approx(turned, abs=0.01)


def las(points, wkt="", keys=(), records=(), scale=1e-3):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = points.min(axis=0), np.full(3, scale)
    header.vlrs.extend(records)
    if wkt:
        header.vlrs.append(WktCoordinateSystemVlr(wkt))
    if keys:
        record = GeoKeyDirectoryVlr()
        record.geo_keys = [GeoKeyEntryStruct(number, 0, 1, value) for number, value in keys]
        record.geo_keys_header.number_of_keys = len(keys)
        header.vlrs.append(record)
    made = laspy.LasData(header)
    made.x, made.y, made.z = points.T
    out = io.BytesIO()
    made.write(out)
    return out.getvalue()


@pytest.fixture(scope="module")
def points():
    x, y = (a.ravel() for a in np.meshgrid(np.arange(0, 2, 0.1), np.arange(0, 2, 0.1)))
    return np.column_stack([x + 700_000.0, y + 5_180_000.0, 0.1 * x])


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ([(3072, 32633), (4096, 6360)], "heights of a.las are in US survey foot"),
        ([(3072, 32633), (4096, 5715)], "depths"),
        ([(3072, 32633), (4099, 9002)], "heights in another unit"),
        ([(3072, 2263)], "US survey foot"),
        ([(2048, 4326)], "degrees"),
        ([(3072, 3857)], "not true to scale"),
        ([(3072, 2)], "EPSG:2,"),
        ([(1024, 1), (2048, 4326), (3072, 32767)], "a projection of its own .* that its keys don't describe"),
        ([(1024, 1), (2048, 4326)], "state the unit"),
        ([(3072, 32633), (4096, 5103)], "heights by the old code 5103, which says no unit"),
        ([(3072, 32633), (4096, 5103), (4099, 9003)], "heights in another unit"),
    ],
)
def test_keys_of_a_las_file_count_as_its_wkt(points, keys, words):
    with pytest.raises(InvalidTerrain, match=words):
        decode_terrain(las(points, keys=keys), "a.las", resolution=0.5)


@pytest.mark.parametrize(("model", "words"), [(2, "geographic, in degrees"), (3, "geocentric")])
def test_a_las_file_on_the_globe_without_a_code_is_refused_whatever_unit_is_said(points, model, words):
    content = las(points, keys=[(1024, model), (2048, 32767)])
    with pytest.raises(InvalidTerrain, match=f"coordinates of a.las are {words}, as its keys say"):
        decode_terrain(content, "a.las", unit="m", resolution=0.5)


def test_a_las_file_tells_true_north_by_wkt_and_by_keys(points):
    utm = CRS.from_epsg(32633)
    for content in (las(points, wkt=utm.to_wkt()), las(points, keys=[(3072, 32633), (4096, 5703)])):
        dem = decode_terrain(content, "a.las", resolution=0.5)
        assert dem.true_north == pytest.approx(convergence(utm, dem.geometry.bounds))
        with pytest.raises(InvalidTerrain, match="are m, as its coordinate system says, not ft"):
            decode_terrain(content, "a.las", resolution=0.5, unit="ft")


def test_old_codes_of_heights_are_read_with_their_unit(points):
    """5103 is NAVD 88 in the first GeoTIFF, and no system of heights in EPSG: it was refused as unknown."""
    dem = decode_terrain(las(points, keys=[(3072, 32633), (4096, 5103), (4099, 9001)]), "a.las", resolution=0.5)
    assert dem.true_north is not None


def test_heights_in_feet_that_the_keys_say_beside_a_wkt_of_the_plane_are_refused(points):
    """LAS 1.4 may have both: feet were read as metres, as the WKT came first and says nothing of heights."""
    wkt = CRS.from_epsg(32633).to_wkt()
    for keys in ([(4099, 9003)], [(4096, 6360)]):
        with pytest.raises(InvalidTerrain, match=r"heights .*(9003|US survey foot)"):
            decode_terrain(las(points, wkt=wkt, keys=keys), "a.las", resolution=0.5)
    metres = CRS.from_user_input("EPSG:32633+5703").to_wkt()
    for content in (
        las(points, wkt=wkt, keys=[(3072, 2263), (4096, 5703), (4099, 9001)]),
        las(points, wkt=metres, keys=[(3072, 2263), (4099, 9003)]),  # of what it was before
    ):
        assert decode_terrain(content, "a.las", resolution=0.5).true_north is not None


def records_of(crs):
    """The records of a LAS file for a coordinate system that has no number, as GDAL writes its keys."""
    with MemoryFile() as memory:
        with memory.open(driver="GTiff", width=1, height=1, count=1, dtype="uint8", crs=crs) as made:
            made.write(np.zeros((1, 1, 1), np.uint8))
        tags: Any = getattr(Image.open(io.BytesIO(memory.read())), "tag_v2")  # noqa: B009 - of TIFF alone
    kinds = (GeoKeyDirectoryVlr, 34735, "<u2"), (GeoDoubleParamsVlr, 34736, "<f8"), (GeoAsciiParamsVlr, 34737, "")
    for kind, tag, numbers in kinds:
        record = kind()
        record.parse_record_data(np.array(tags[tag], numbers).tobytes() if numbers else tags[tag].encode() + b"\0")
        yield record


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_a_projection_that_a_las_file_defines_by_its_keys_is_that_projection(points):
    own = "+proj=tmerc +lat_0=46 +lon_0=17.5 +k=1 +x_0=700000 +y_0=5180000 +ellps=GRS80"
    dem = decode_terrain(las(points, records=records_of(CRS.from_proj4(own))), "a.las", resolution=0.5)
    assert dem.true_north == pytest.approx(convergence(CRS.from_proj4(own), dem.geometry.bounds))
    for twisted, words in (
        (("+k=1", "+k=1.05"), "true to scale"),
        (("+ellps", "+units=us-ft +ellps"), "US|another unit"),
    ):
        content = las(points, records=records_of(CRS.from_proj4(own.replace(*twisted))))
        with pytest.raises(InvalidTerrain, match=words):
            decode_terrain(content, "a.las", resolution=0.5)


def test_a_projection_beside_a_scan_says_its_unit_and_no_other_may_be_said(tmp_path, points):
    path = tmp_path / "a.xyz"
    np.savetxt(path, points, fmt="%.3f")
    with pytest.raises(InvalidTerrain, match="--unit"):
        read_terrain(path, up="z", resolution=0.5)
    (tmp_path / "a.prj").write_text(CRS.from_epsg(32633).to_wkt())
    assert read_terrain(path, up="z", resolution=0.5).geometry.bounds[2] == pytest.approx(700_002.0, abs=0.3)
    with pytest.raises(InvalidTerrain, match="not ft"):
        read_terrain(path, up="z", resolution=0.5, unit="ft")


def test_a_las_file_that_keeps_whole_metres_makes_no_finer_cells(points):
    content = las(points, keys=[(3072, 32633)], scale=1.0)
    for resolution in (None, 0.5):
        told = "in steps of 1 m, coarser than its cells of 0..* m; take --resolution 1 or coarser"
        with pytest.raises(InvalidTerrain, match=told):
            decode_terrain(content, "a.las", resolution=resolution)
    assert decode_terrain(content, "a.las", resolution=1.0).geometry.resolution == 1.0
