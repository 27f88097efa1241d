"""Units that the keys of a GeoTIFF state by a code, whether GDAL knows them or not."""

import numpy as np
import pytest
import rasterio
from PIL import Image
from PIL.TiffImagePlugin import ImageFileDirectory_v2
from rasterio.crs import CRS
from rasterio.transform import Affine

from footfall.core.errors import InvalidTerrain
from footfall.io.geo_keys import geo_keys
from footfall.io.terrain_files import decode_terrain, read_terrain

HEIGHTS = 2.0 + 0.01 * np.arange(144, dtype=np.float32).reshape(12, 12)
LOCAL = [(1024, 1), (3072, 32767)]
UTM = [(1024, 1), (3072, 32633)]


def geotiff(path, keys):
    tags = ImageFileDirectory_v2()
    numbers = [number for key, said in keys for number in (key, 0, 1, said)]
    for tag, kind, said in (
        (33550, 12, (0.5, 0.5, 0.0)),
        (33922, 12, (0.0, 0.0, 0.0, 500_000.0, 5_180_000.0, 0.0)),
        (34735, 3, (1, 1, 0, len(keys), *numbers)),
    ):
        tags.tagtype[tag] = kind
        tags[tag] = said
    Image.fromarray(HEIGHTS).save(path, "TIFF", tiffinfo=tags)
    return path


@pytest.mark.parametrize("unit", [9002, 9003, 9005, 9036, 9093, 9096, 1025, 1033])
def test_local_coordinates_in_another_unit_are_refused_whatever_its_code(tmp_path, unit):
    """GDAL took all of them but feet for metres: kilometres were read as metres."""
    path = geotiff(tmp_path / "a.tif", [*LOCAL, (3076, unit)])
    for read in (lambda: read_terrain(path), lambda: decode_terrain(path.read_bytes(), "a.tif")):
        with pytest.raises(InvalidTerrain, match=rf"lengths in another unit than metres .EPSG:{unit}.|foot"):
            read()


@pytest.mark.parametrize("keys", [[(4096, 5103), (4099, 9003)], [(4099, 9036)], [(4096, 5703), (4099, 9002)]])
def test_heights_in_another_unit_are_refused_whatever_the_code_of_their_system(tmp_path, keys):
    """Heights in feet of NAVD 88 by its old code, 5103, were read as metres."""
    with pytest.raises(InvalidTerrain, match=r"heights .*(another unit than metres|kilometre|foot)"):
        read_terrain(geotiff(tmp_path / "a.tif", [*UTM, *keys]))


@pytest.mark.parametrize("keys", [LOCAL, UTM, [*LOCAL, (3076, 9001)], [*UTM, (4096, 5103), (4099, 9001)]])
def test_metres_are_taken(tmp_path, keys):
    assert read_terrain(geotiff(tmp_path / "a.tif", keys)).heights.min() == 2.0


@pytest.mark.parametrize("options", [{}, {"BIGTIFF": "YES"}, {"ENDIANNESS": "BIG"}])
def test_keys_of_every_kind_of_tiff_are_those_that_gdal_wrote(tmp_path, options):
    profile = {"driver": "GTiff", "width": 12, "height": 12, "count": 1, "dtype": "float64", **options}
    at = Affine(0.5, 0, 500_000.0, 0, -0.5, 5_180_000.0)
    with rasterio.open(tmp_path / "a.tif", "w", **profile, crs=CRS.from_epsg(32633), transform=at) as made:
        made.write(HEIGHTS.astype(np.float64), 1)
    keys = geo_keys(tmp_path / "a.tif")
    assert keys[3072] == 32633
    assert geo_keys((tmp_path / "a.tif").read_bytes()) == keys
    assert geo_keys(b"no TIFF at all") == geo_keys(b"II*\0") == {}
