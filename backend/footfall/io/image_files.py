"""Grey images in files, and photographed stereo pairs with their calibration."""

import io
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, UnidentifiedImageError
from PIL.ImageFile import ImageFile

from footfall.core.errors import InvalidImages
from footfall.telemetry.images import Camera, ImagePair

MAX_PIXELS = 50_000_000
"""Largest accepted image."""

IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".pgm", ".ppm")
_FORMATS = ("PNG", "JPEG", "TIFF", "PPM")
_ORIENTATION = 0x0112
_BOMB = 2 * 89_478_485 + 1
"""Pixels from which the reader of images tells no size any more (``PIL.Image.MAX_IMAGE_PIXELS``)."""


def claimed_pixels(content: bytes, formats: tuple[str, ...] = _FORMATS) -> int:
    """How many pixels an encoded image has by its head; 0 where it has none, and is refused when it is read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(content), formats=formats) as image:
                return image.width * image.height
    except Image.DecompressionBombError:
        return _BOMB
    except (OSError, SyntaxError, ValueError):
        return 0


def decode_image(content: bytes, name: str = "image") -> NDArray[np.uint8]:
    """Grey image, (height, width) uint8, of an encoded one; colours by ITU-R 601 luma.

    Raises InvalidImages, naming it, where the content is damaged, no image, too large, of more than 8 bits, or stored
    turned: whether its calibration was made of turned images or of these, nobody says.
    """
    if not content:
        raise InvalidImages(f"{name} is empty")
    try:
        with Image.open(io.BytesIO(content), formats=_FORMATS) as image:
            if image.width * image.height > MAX_PIXELS:
                raise InvalidImages(f"{name} has {image.width} × {image.height} pixels; the limit is {MAX_PIXELS}")
            if image.mode not in ("1", "L", "LA", "P", "RGB", "RGBA"):
                raise InvalidImages(
                    f"{name} has pixels of mode {image.mode}; FootFall reads 8-bit grey and RGB: export it so"
                )
            if _deep(image):
                raise InvalidImages(f"{name} has 16 bits a channel; FootFall reads 8: scale them down to that")
            turned = image.getexif().get(_ORIENTATION, 1)
            if turned != 1:
                raise InvalidImages(
                    f"{name} is stored turned (EXIF orientation {turned}); store its pixels as its calibration has "
                    "them, without that mark"
                )
            return np.array(image.convert("L"))
    except UnidentifiedImageError as err:
        raise InvalidImages(f"{name} is no readable image: {', '.join(_FORMATS)} are read") from err
    except Image.DecompressionBombError as err:
        raise InvalidImages(f"{name} has more pixels than are read") from err
    except (OSError, SyntaxError, ValueError) as err:
        raise InvalidImages(f"{name} is damaged or cut") from err


def _deep(image: ImageFile) -> bool:
    """Whether its file holds more than 8 bits a channel, of which the reader would take the upper 8 without a word."""
    for tile in image.tile:
        given = tile.args if isinstance(tile.args, tuple) else (tile.args,)
        # netpbm files say the greatest value, the others name the layout of their bytes
        if (tile.codec_name.startswith("ppm") and [*given][1:] not in ([], [255])) or ";16" in str([*given][:1]):
            return True
    return False


def encode_png(image: NDArray[np.uint8]) -> bytes:
    """PNG of a grey (height, width) or colour (height, width, 3) uint8 image; equal images give equal bytes."""
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] not in (3, 4)):
        raise InvalidImages(f"a PNG needs uint8 (h, w), (h, w, 3) or (h, w, 4), not {image.dtype} {image.shape}")
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG", compress_level=3)
    return out.getvalue()


def read_image(path: str | Path) -> NDArray[np.uint8]:
    """Grey image, (height, width) uint8, from a file. Raises InvalidImages naming the file."""
    path = Path(path)
    if path.suffix.lower() not in IMAGE_ENDINGS:
        raise InvalidImages(f"{path.name} is no image file that FootFall reads ({', '.join(IMAGE_ENDINGS)})")
    if not path.is_file():
        raise InvalidImages(f"there is no image file {path}")
    return decode_image(path.read_bytes(), path.name)


def write_png(image: NDArray[np.uint8], path: str | Path) -> None:
    """Write a uint8 image as PNG."""
    Path(path).write_bytes(encode_png(image))


def read_pair(
    left: str | Path,
    right: str | Path,
    *,
    focal_length: float,
    cx: float,
    cy: float,
    baseline: float,
    doffs: float = 0.0,
    T_base_camera: ArrayLike | None = None,
    T_site_base: ArrayLike | None = None,
    name: str | None = None,
    time: float = 0.0,
) -> ImagePair:
    """A rectified photographed pair.

    focal_length, cx, cy: of the left camera [px]; baseline [m]; doffs: cx of the right camera less that of the left
    one [px], as the Middlebury sets give it (depth = focal_length · baseline / (disparity + doffs)).
    T_base_camera: pose of the left camera, (4, 4), by default looking along +x of base, level, at its origin.
    T_site_base: (4, 4), by default identity. Raises InvalidImages.
    """
    images = read_image(left), read_image(right)
    name = name or Path(left).stem
    if images[0].shape != images[1].shape:
        sizes = " and ".join(f"{image.shape[1]} × {image.shape[0]}" for image in images)
        raise InvalidImages(f"pair {name}: the images have different sizes, {sizes}", pair=name)
    if not baseline > 0:
        raise InvalidImages(f"pair {name}: the baseline needs a length above zero [m]", baseline=baseline)
    height, width = images[0].shape
    if of_larger_images(cx, cy, width, height):
        raise InvalidImages(
            f"pair {name}: its calibration has its centre at ({cx:g}, {cy:g}), in the far corner of {width} × {height} "
            "pixels: it is of larger images; bring focal_length, cx, cy and doffs to the size of these",
            pair=name,
        )
    T_left = np.array(LEVEL_FORWARD if T_base_camera is None else T_base_camera, float)
    T_right = T_left.copy()
    T_right[:3, 3] += baseline * T_left[:3, 0]
    left_camera, right_camera = (
        Camera(f"{name} {side}", width, height, focal_length, focal_length, center, cy, T)
        for side, center, T in (("left", cx, T_left), ("right", cx + doffs, T_right))
    )
    T = np.eye(4) if T_site_base is None else np.asarray(T_site_base, float)
    return ImagePair(name, time, images[0], images[1], left_camera, right_camera, T)


def of_larger_images(cx: float, cy: float, width: int, height: int) -> bool:
    """Whether a calibration is of larger images than one of this size, for which it says no size [px].

    Its centre lies in the far corner then, as that of one twice as large does. Parts that are cut out of an image have
    theirs elsewhere: who cuts away the sky keeps what is below the centre.
    """
    return cx > _FAR_CORNER * width and cy > _FAR_CORNER * height


_FAR_CORNER = 0.8
"""Of the width and the height; centres of lenses lie at half of both, within some hundredths."""

LEVEL_FORWARD = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""T_base_camera of a camera at the base's origin that looks along +x with level image rows."""
