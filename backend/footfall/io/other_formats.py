"""Formats that are not read as terrain, by the endings of their names, and what makes one of them that is."""

from pathlib import PurePath

from footfall.core.errors import InvalidTerrain

_GDAL = "GDAL makes a GeoTIFF of it, with its no-data value, scale and offset: gdal_translate {name} ground.tif"
_OF_VARIABLE = f"{_GDAL} (of one of several variables: NETCDF:{{name}}:z)"
_OF_LABEL = f"{_GDAL}; it passes over the UNIT of a PDS3 label, which has to be METER"
_MESH = "export it as PLY or OBJ with z up, in metres, all its parts where their transforms place them"
_MODEL = "export it as PLY or OBJ with z up, in metres"
_KINDS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("NetCDF", _OF_VARIABLE, (".nc", ".nc4", ".cdf")),
    ("an image of PDS or ISIS, or its label", _OF_LABEL, (".img", ".lbl", ".xml", ".cub", ".vic")),
    ("an ENVI or ESRI raster, or its header", _GDAL, (".hdr", ".bil", ".bip", ".bsq", ".flt", ".dat", ".adf")),
    ("another raster", _GDAL, (".grd", ".dem", ".hgt", ".dt0", ".dt1", ".dt2", ".vrt", ".jp2", ".h5", ".hdf", ".grb")),
    ("a GeoPackage", f"{_GDAL}; points and lines in it hold no ground", (".gpkg",)),
    ("glTF, which has y up", _MESH, (".glb", ".gltf")),
    ("Collada, which has a unit and a direction up of its own", _MESH, (".dae",)),
    ("a model", _MODEL, (".fbx", ".3mf", ".usd", ".usda", ".usdc", ".usdz", ".blend", ".3ds", ".wrl", ".x3d", ".dxf")),
    ("a model", _MODEL, (".stp", ".step", ".igs", ".iges", ".ifc", ".vtp", ".vtu")),
    ("a scan in E57", "make LAZ of it: pdal translate {name} scan.laz", (".e57",)),
    ("a scan in text", "name it .xyz: x, y and z first in each row, behind their count", (".pts",)),
    ("a recording", "write its points as PCD, and say with --pose where the sensor was", (".bag", ".db3", ".mcap")),
    (
        "of places and lines, which hold no ground",
        "take an elevation model, such as .tif",
        (".gpx", ".kml", ".kmz", ".shp"),
    ),
    ("packed", "unpack it first", (".zip", ".gz", ".bz2", ".xz", ".zst", ".7z", ".tar", ".tgz")),
    (
        "a picture, which holds no heights",
        "take an elevation model, such as .tif",
        (".jpg", ".jpeg", ".webp", ".bmp", ".gif"),
    ),
)


def refuse_other_format(name: str) -> None:
    """Raise InvalidTerrain for a name that ends as that of a format which isn't read, saying what would be."""
    ending = PurePath(name).suffix.lower()
    for kind, how, endings in _KINDS:
        if ending in endings:
            raise InvalidTerrain(f"{name} is {kind}, and is not read as terrain; {how.format(name=name)}")
