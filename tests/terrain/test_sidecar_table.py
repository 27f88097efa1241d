"""Every kind of file that GDAL heeds beside a raster, placed or not: read as rasterio reads it, or refused by name."""

import warnings
from html import escape

import numpy as np
import pytest
import rasterio
from rasterio.crs import CRS
from rasterio.errors import NotGeoreferencedWarning
from rasterio.transform import Affine

from footfall.core.errors import InvalidTerrain
from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.io.terrain_sidecars import names_beside
from footfall.terrain.from_arrays import from_heights

SIDE = 8
HEIGHTS = (2.0 + 0.25 * np.arange(SIDE * SIDE, dtype=np.float32)).reshape(SIDE, SIDE)
FEET = CRS.from_epsg(2263).to_wkt()
POLYNOMIALS = {f"{axis}_{what}": 1 for axis in ("LINE", "SAMP", "LAT", "LONG", "HEIGHT") for what in ("OFF", "SCALE")}
COEFFICIENTS = [f"{axis}_{part}_COEFF" for axis in ("LINE", "SAMP") for part in ("NUM", "DEN")]


def pam(of_band="", of_all=""):
    return f'<PAMDataset>{of_all}<PAMRasterBand band="1">{of_band}</PAMRasterBand></PAMDataset>'


def point(column, row, x, y):
    return f'<GCP Id="" Pixel="{column}" Line="{row}" X="{x}" Y="{y}"/>'


POINTS = point(0, 0, 0, 0) + point(8, 0, 4, 1) + point(0, 8, 1, -4)
RPC_TEXT = "".join(f"{key}: {number}\n" for key, number in POLYNOMIALS.items())
RPC_TEXT += "".join(f"{key}_{i}: 1\n" for key in COEFFICIENTS for i in range(1, 21))
RPC_DOMAIN = "".join(f'<MDI key="{key}">{number}</MDI>' for key, number in POLYNOMIALS.items())
RPC_DOMAIN += "".join(f'<MDI key="{key}">{"1 " * 20}</MDI>' for key in COEFFICIENTS)
CORNERS = [((100, 200), (0, 0)), ((102, 200), (8, 0)), ((102, 198), (8, 8)), ((100, 198), (0, 8))]
TAB = '!table\n!version 300\n!charset WindowsLatin1\nDefinition Table\n  File "a.tif"\n  Type "RASTER"\n'
TAB += ",\n".join(f'  ({x},{y}) ({c},{r}) Label "p"' for (x, y), (c, r) in CORNERS)
TAB += '\n  CoordSys Earth Projection 8, 104, "m", 15, 0, 0.9996, 500000, 0\n  Units "m"\n'
WORLD = "0.25\n0\n0\n-0.25\n100.125\n199.875\n"

# name, content, what it does to a GeoTIFF with a place, to one without, and to an ASCII grid:
# "as GDAL" (heeded, and it changes something), "nothing", or words of the refusal
TABLE = [
    ("{}.msk", None, "as GDAL", "as GDAL", "as GDAL"),
    ("{}.MSK", None, "as GDAL", "as GDAL", "as GDAL"),
    ("{}.msk", "damaged", "is no mask", "is no mask", "is no mask"),
    ("{}.aux.xml", pam("<NoDataValue>2.5</NoDataValue>"), "as GDAL", "as GDAL", "NODATA_value"),
    ("{}.AUX.XML", pam("<NoDataValue>2.5</NoDataValue>"), "tif.aux.xml; name", "tif.aux.xml; name", "NODATA_value"),
    ("{}.aux.xml", pam("<Offset>-2</Offset><Scale>1.5</Scale>"), "as GDAL", "as GDAL", "as GDAL"),
    ("{}.aux.xml", pam("<UnitType>ft</UnitType>"), "'ft'", "'ft'", "'ft'"),
    ("{}.aux.xml", pam("", f"<SRS>{escape(FEET)}</SRS>"), *3 * ["US survey foot"]),
    ("{}.aux.xml", pam("", "<SRS>EPSG:4326</SRS>"), *3 * ["degrees"]),
    ("{}.aux.xml", pam("", "<GeoTransform>9, 0.25, 0, 7, 0, -0.25</GeoTransform>"), "as GDAL", "as GDAL", "xllcorner"),
    ("{}.aux.xml", pam("", f"<GCPList>{POINTS}</GCPList>"), *3 * ["3 control points"]),
    ("{}.aux.xml", pam("", f'<Metadata domain="RPC">{RPC_DOMAIN}</Metadata>'), *3 * ["rational polynomials"]),
    ("{}.aux.xml", pam("", '<Metadata domain="GEOLOCATION"><MDI key="X_BAND">1</MDI></Metadata>'), *3 * ["positions"]),
    ("{}.aux.xml", pam("<ColorInterp>Red</ColorInterp>"), *3 * ["picture"]),
    ("{}.aux.xml", pam("", '<Metadata><MDI key="STATISTICS_MEAN">3</MDI></Metadata>'), *3 * ["nothing"]),
    ("{}.aux.xml", "<PAMDataset><PAMRasterBand", *3 * ["no whole XML"]),
    ("{}.aux.xml", '<!DOCTYPE a [<!ENTITY b "b">]><PAMDataset/>', *3 * ["no whole XML"]),
    ("a.aux.xml", pam("<NoDataValue>2.5</NoDataValue>"), "aux.xml; name", "aux.xml; name", "NODATA_value"),
    *((name, WORLD, "nothing", "as GDAL", f"{name} lies") for name in ("a.tfw", "a.TFW", "a.Tfw", "a.tifw", "a.wld")),
    ("a.tiffw", WORLD, "nothing", "a.tiffw lies", "a.tiffw lies"),
    ("a.tfw", "0.25\n0\nhello\n", "nothing", "a.tfw lies", "a.tfw lies"),
    ("a.tfw", "1\n0\n0\n1\n0.5\n0.5\n", "nothing", "a.tfw lies", "a.tfw lies"),
    ("a.tfw", "0.25\n0.1\n0.1\n-0.25\n1\n2\n", "nothing", "rotated", "a.tfw lies"),
    ("a.tab", TAB, "nothing", "as GDAL", "a.tab lies"),
    ("a_rpc.txt", RPC_TEXT, "rational polynomials", "rational polynomials", "a_rpc.txt lies"),
    ("a.prj", FEET, *3 * ["US survey foot"]),
    ("a.PRJ", FEET, *3 * ["US survey foot"]),
    ("a.qpj", FEET, *3 * ["US survey foot"]),
    ("a.hdr", "nodata 2.5\n", *3 * ["nothing"]),
    ("a.stx", "1 2 3 2.5 0.1\n", *3 * ["nothing"]),
    ("a.clr", "2 255 0 0\n", *3 * ["nothing"]),
]
CASES = [
    pytest.param(kind, name, content, outcome, id=f"{kind}-{name.format('a')}-{number}")
    for number, (name, content, *outcomes) in enumerate(TABLE)
    for kind, outcome in zip(("placed.tif", "unplaced.tif", "placed.asc"), outcomes, strict=True)
]


def raster(path, kind):
    if kind.endswith("asc"):
        head = f"ncols {SIDE}\nnrows {SIDE}\nxllcorner 500000\nyllcorner 5180000\ncellsize 0.5\n"
        path.write_text(head + "\n".join(" ".join(f"{z:.2f}" for z in row) for row in HEIGHTS) + "\n")
        return
    place = {"transform": Affine(0.5, 0, 500_000.0, 0, -0.5, 5_180_000.0), "crs": CRS.from_epsg(32633)}
    profile = {"driver": "GTiff", "width": SIDE, "height": SIDE, "count": 1, "dtype": "float32"}
    with rasterio.open(path, "w", **profile, **(place if kind == "placed.tif" else {})) as target:
        target.write(HEIGHTS, 1)


def mask(path):
    profile = {"driver": "GTiff", "width": SIDE, "height": SIDE, "count": 1, "dtype": "uint8"}
    with rasterio.open(path, "w", **profile) as target:
        target.write(np.where(HEIGHTS > 5, np.uint8(255), np.uint8(0)), 1)
        target.update_tags(INTERNAL_MASK_FLAGS_1="2")


def of_gdal(path):
    """Heights from the south, the south-west cell's x and y, and the cell size; of what has no place (0, 0) and 0.5."""
    with rasterio.open(path) as source:
        read = source.read(1, masked=True).astype(float).filled(np.nan) * source.scales[0] + source.offsets[0]
        at = Affine(0.5, 0, -0.25, 0, -0.5, 0.5 * (SIDE - 0.5)) if source.transform.is_identity else source.transform
        x, y = at @ (0.5, SIDE - 0.5)
        return read[::-1], (x, y), at.a


def of_ours(path):
    with rasterio.open(path) as source:
        unplaced = source.transform.is_identity
    dem = read_terrain(path, resolution=0.5 if unplaced else None)
    return dem.heights, (dem.geometry.x0, dem.geometry.y0), dem.geometry.resolution


def same(one, other):
    return np.allclose(one[0], other[0], equal_nan=True) and np.allclose([*one[1], one[2]], [*other[1], other[2]])


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
@pytest.mark.parametrize(("kind", "name", "content", "outcome"), CASES)
def test_what_lies_beside_a_raster(tmp_path, kind, name, content, outcome):
    path = tmp_path / f"a{kind[-4:]}"
    raster(path, kind)
    alone = of_gdal(path)
    assert same(of_ours(path), alone)
    other = tmp_path / name.format(path.name)
    assert other.name.lower() in names_beside(path.name), "an upload could not take it along"
    if content is None:
        mask(other)
    else:
        other.write_text(content)
    if outcome not in ("as GDAL", "nothing"):
        with pytest.raises(InvalidTerrain, match=outcome):
            of_ours(path)
        return
    beside = of_gdal(path)
    assert same(beside, alone) == (outcome == "nothing"), "what this row is there for does not happen"
    assert same(of_ours(path), beside)


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_a_value_declared_beside_a_mask_still_stands_for_none(tmp_path):
    """GDAL forgets the no-data value of a file that has a mask; both are declared."""
    path = tmp_path / "a.tif"
    raster(path, "placed.tif")
    with rasterio.open(path, "r+") as target:
        target.nodata = float(HEIGHTS[-1, -1])
    mask(tmp_path / "a.tif.msk")
    found = read_terrain(path).heights[::-1]
    assert np.isnan(found[-1, -1])
    np.testing.assert_array_equal(np.isnan(found), (HEIGHTS <= 5) | np.equal(HEIGHTS, HEIGHTS[-1, -1]))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.aux.xml", pam("<Scale>2</Scale>")),
        ("a.tfw", WORLD),
        ("a.tab", TAB),
        ("{}.msk", "x"),
        ("a_rpc.txt", RPC_TEXT),
    ],
)
@pytest.mark.parametrize("ending", ["obj", "npz", "xyz"])
def test_what_no_reader_of_a_kind_heeds_is_refused_by_name(tmp_path, ending, name, content):
    path = tmp_path / f"a.{ending}"
    path.write_bytes(b"never read")
    other = tmp_path / name.format(path.name)
    other.write_text(content)
    with pytest.raises(InvalidTerrain, match=other.name):
        read_terrain(path, unit="m" if ending == "xyz" else None)


def test_rasterio_says_nothing_of_a_damaged_mask(tmp_path):
    """Why a mask beside is looked for by us: GDAL reads all cells as known."""
    path = tmp_path / "a.tif"
    raster(path, "placed.tif")
    (tmp_path / "a.tif.msk").write_text("damaged")
    with warnings.catch_warnings():
        warnings.simplefilter("error", NotGeoreferencedWarning)
        assert np.isfinite(of_gdal(path)[0]).all()


@pytest.mark.parametrize("ending", ["tif", "asc", "obj"])
def test_nothing_is_written_where_the_mask_of_another_terrain_lies(tmp_path, ending):
    dem = from_heights(HEIGHTS, 0.5)
    path = tmp_path / f"a.{ending}"
    for name, content in ((f"a.{ending}.msk", "of another"), (f"a.{ending}.aux.xml", pam("<Scale>2</Scale>"))):
        (tmp_path / name).write_text(content)
        with pytest.raises(InvalidTerrain, match=f"{name} lies where"):
            write_terrain(dem, path)
        assert not path.exists()
        (tmp_path / name).unlink()
    (tmp_path / f"a.{ending}.aux.xml").write_text(pam("", "<Metadata/>"))  # says nothing
    write_terrain(dem, path)
    np.testing.assert_allclose(read_terrain(path, resolution=0.5).heights, HEIGHTS)
