import io
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from footfall.core.errors import InvalidImages
from footfall.io.image_files import decode_image, encode_png, read_image, read_pair, write_png

CALIBRATION: dict[str, Any] = {"focal_length": 100.0, "cx": 20.0, "cy": 15.0, "baseline": 0.2}


@pytest.fixture
def picture(rng) -> np.ndarray:
    return rng.integers(0, 256, (30, 40), dtype=np.uint8)


def test_png_round_trip(picture, tmp_path):
    write_png(picture, tmp_path / "a.png")
    assert np.array_equal(read_image(tmp_path / "a.png"), picture)
    assert encode_png(picture) == encode_png(picture.copy())


def test_colour_is_read_as_grey(tmp_path):
    colour = np.zeros((4, 4, 3), np.uint8)
    colour[..., 1] = 200
    write_png(colour, tmp_path / "a.png")
    assert np.abs(read_image(tmp_path / "a.png").astype(int) - round(0.587 * 200)).max() <= 1


def test_unusable_files_are_refused_by_name(picture, tmp_path):
    (tmp_path / "text.png").write_text("no image")
    (tmp_path / "cut.png").write_bytes(encode_png(picture)[:-400])
    (tmp_path / "a.npy").write_bytes(b"")
    (tmp_path / "none.tif").write_bytes(b"")
    Image.fromarray(np.zeros((4, 4), np.uint16)).save(tmp_path / "deep.png")
    for name, says in (
        ("text.png", "no readable image"),
        ("cut.png", "damaged"),
        ("a.npy", "no image file"),
        ("deep.png", "8-bit"),
        ("none.png", "there is no image file"),
        ("none.tif", "is empty"),
    ):
        with pytest.raises(InvalidImages, match=says) as caught:
            read_image(tmp_path / name)
        assert name in str(caught.value)
        assert "0x" not in str(caught.value)  # the same file gives the same words, which a map carries


def test_sixteen_bits_are_not_cut_to_eight(tmp_path):
    """Twelve bits in sixteen would be left with four: dark images with sixteen greys."""
    deep = np.repeat(np.arange(0, 4096, 64).astype(np.uint16).reshape(8, 8, 1), 3, 2)
    for ending in (".png", ".tif", ".ppm"):
        cv2.imwrite(str(tmp_path / f"a{ending}"), deep)
        with pytest.raises(InvalidImages, match="16 bits a channel"):
            read_image(tmp_path / f"a{ending}")
        cv2.imwrite(str(tmp_path / f"b{ending}"), (deep // 16).astype(np.uint8))
        assert read_image(tmp_path / f"b{ending}").shape == (8, 8)


@pytest.mark.parametrize("orientation", [1, 3, 6])
def test_an_image_that_is_stored_turned_is_refused(orientation, picture, tmp_path):
    marks = Image.Exif()
    marks[0x0112] = orientation
    Image.fromarray(picture).save(tmp_path / "a.jpg", exif=marks)
    if orientation == 1:
        assert read_image(tmp_path / "a.jpg").shape == picture.shape
    else:
        with pytest.raises(InvalidImages, match=f"EXIF orientation {orientation}"):
            read_image(tmp_path / "a.jpg")


def test_absurd_size_is_refused_before_it_is_unpacked():
    out = io.BytesIO()
    Image.new("1", (10000, 6000)).save(out, "PNG")
    with pytest.raises(InvalidImages, match="limit"):
        decode_image(out.getvalue())


def test_only_images_are_written():
    wrong_ones: list[Any] = [np.zeros((4, 4)), np.zeros(4, np.uint8), np.zeros((4, 4, 2), np.uint8)]
    for wrong in wrong_ones:
        with pytest.raises(InvalidImages):
            encode_png(wrong)


def test_pair_with_calibration(picture, tmp_path):
    for side in ("left", "right"):
        write_png(picture, tmp_path / f"{side}.png")
    pair = read_pair(tmp_path / "left.png", tmp_path / "right.png", doffs=3.0, name="yard", **CALIBRATION)
    assert pair.name == "yard"
    assert pair.baseline == pytest.approx(0.2)
    assert pair.camera_right.cx - pair.camera_left.cx == 3.0
    assert np.allclose(pair.camera_right.T_base_camera[:3, 3], [0.0, -0.2, 0.0])  # to the right of +x is −y


def test_pairs_that_do_not_fit_are_refused(picture, tmp_path):
    write_png(picture, tmp_path / "left.png")
    write_png(picture[:-1], tmp_path / "right.png")
    with pytest.raises(InvalidImages, match="different sizes"):
        read_pair(tmp_path / "left.png", tmp_path / "right.png", **CALIBRATION)
    with pytest.raises(InvalidImages, match="baseline"):
        read_pair(tmp_path / "left.png", tmp_path / "left.png", **{**CALIBRATION, "baseline": 0.0})
    with pytest.raises(InvalidImages, match="focal"):
        read_pair(tmp_path / "left.png", tmp_path / "left.png", **{**CALIBRATION, "focal_length": -5.0})


def test_a_calibration_of_larger_images_is_refused(picture, tmp_path):
    """Pairs half as large came out twice as far away."""
    write_png(picture, tmp_path / "left.png")
    height, width = picture.shape
    twice = {**CALIBRATION, "cx": 0.98 * width, "cy": 1.02 * height}
    with pytest.raises(InvalidImages, match=f"far corner of {width} × {height} pixels: it is of larger images"):
        read_pair(tmp_path / "left.png", tmp_path / "left.png", **twice)
