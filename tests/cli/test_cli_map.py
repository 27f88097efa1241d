"""``footfall map``: files of all layers or of one, settings of balance, and suggested footfalls."""

import json
from pathlib import Path

import numpy as np
import pytest
import rasterio

from footfall.io.terrain_files import read_terrain, write_terrain
from footfall.maps.layers import LAYERS, REACHABLE_STABLE
from tests.support.chassis_ground import wavy
from tests.support.command_line import run

LEG = 2


def answer(*arguments: object) -> dict:
    return json.loads(run("map", *arguments, "--leg", LEG, "--json").stdout)


@pytest.fixture(scope="module")
def ground(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("ground") / "waves.npz"
    write_terrain(wavy(half=3.5), path)
    return path


@pytest.fixture(scope="module")
def plain(ground, tmp_path_factory) -> tuple[dict, Path]:
    """What is told of maps without options, and all of their layers."""
    out = tmp_path_factory.mktemp("maps") / "maps.npz"
    return answer(ground, "--out", out), out


def test_all_layers_go_into_one_file(ground, plain, tmp_path):
    told, npz = plain
    assert told["written"] == str(npz)
    tif = tmp_path / "maps.tif"
    assert answer(ground, "--out", tif)["digest"] == told["digest"]
    with np.load(npz) as arrays, rasterio.open(tif) as bands:
        assert [text.split(" [")[0] for text in bands.descriptions] == told["layers"]
        for band, name in enumerate(told["layers"], 1):
            np.testing.assert_array_equal(bands.read(band)[::-1], arrays[name].astype(np.float32), err_msg=name)
        stable = (arrays["footing"] == REACHABLE_STABLE).sum() * read_terrain(ground).geometry.resolution ** 2
    assert told["area_m2"]["stable"] == pytest.approx(stable)


def test_one_layer_goes_into_a_picture_or_an_array(ground, plain, tmp_path):
    _, npz = plain
    assert "m² reachable and stable" in run("map", ground, "--leg", LEG, "--out", tmp_path / "footing.npy").stdout
    answer(ground, "--layer", "slope", "--out", tmp_path / "slope.npy")
    with np.load(npz) as arrays:
        for name in ("footing", "slope"):
            np.testing.assert_array_equal(np.load(tmp_path / f"{name}.npy"), arrays[name])
    answer(ground, "--layer", "slope", "--out", tmp_path / "slope.png")
    assert (tmp_path / "slope.png").read_bytes().startswith(b"\x89PNG")


def test_friction_adds_its_layers(ground, plain, tmp_path):
    assert set(LAYERS) - set(plain[0]["layers"]) == {
        "margin_friction",
        "margin_friction_conservative",
        "torque_ratio",
        "footing_friction",
    }
    margins = []
    for options in (("--friction-aware",), ("--friction", "0.6"), ("--friction", "0.005")):
        told = answer(ground, *options, "--layer", "margin_friction", "--out", tmp_path / "margin.npy")
        assert set(told["layers"]) == set(LAYERS)
        margins.append(np.load(tmp_path / "margin.npy"))
    np.testing.assert_array_equal(margins[0], margins[1], err_msg="0.6 unless given")
    known = np.isfinite(margins[1])
    assert known.any()
    assert (margins[2][known] < margins[1][known] - 0.1).all(), "on ice hardly anything holds"


def test_gravity_by_name_and_number(ground, plain, tmp_path):
    energies = []
    for gravity in ("moon", "1.62", "3.24"):
        answer(ground, "--gravity", gravity, "--layer", "tip_energy", "--out", tmp_path / "energy.npy")
        energies.append(np.load(tmp_path / "energy.npy"))
    np.testing.assert_array_equal(energies[0], energies[1])
    known = np.isfinite(energies[0])
    assert known.any()
    np.testing.assert_allclose(energies[2][known], 2 * energies[0][known], rtol=1e-5)


def test_conservative_footing(ground, plain):
    told = answer(ground, "--conservative")
    assert told["stability"] == "conservative"
    assert told["area_m2"]["stable"] <= plain[0]["area_m2"]["stable"]


def test_suggested_footfalls_with_their_reasons(ground, plain):
    told = answer(ground, "--suggest", 3)
    best = told["suggestions"]["footfalls"]
    assert len(best) == 3
    with np.load(plain[1]) as arrays:
        for one in best:
            assert arrays["footing"][one["row"], one["col"]] == REACHABLE_STABLE
            assert one["score"] == pytest.approx(float(arrays["quality"][one["row"], one["col"]]), abs=1e-6)
        assert best[0]["score"] == pytest.approx(float(np.nanmax(arrays["quality"])), abs=1e-6)
    lines = run("map", ground, "--leg", LEG, "--suggest", 3).stdout.splitlines()
    for rank, one in enumerate(best, 1):
        (line,) = [line for line in lines if line.startswith(f"{rank}. ")]
        assert f"({one['x']:.2f}, {one['y']:.2f}) m" in line
        assert all(reason in line for reason in (one["apart"]["text"], *one["reasons"]))
    assert "suggestions" not in plain[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--out", "maps.docx"], "maps are written as"),
        (["--out", "maps.tif", "--layer", "slope"], "takes all layers"),
        (["--out", "maps.png", "--layer", "beauty"], "no layer 'beauty'"),
        (["--layer", "slope"], "--out"),
        (["--gravity", "venus"], "earth, moon, mars"),
        (["--gravity", "nan"], "gravity"),
        (["--gravity", "-1"], "gravity"),
        (["--friction", "-1"], "friction"),
        (["--layer", "torque_ratio", "--out", "ratio.png"], "no layer 'torque_ratio'"),
    ],
)
def test_misuse_is_one_line(ground, tmp_path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    result = run("map", ground, "--leg", LEG, *options, code=2)
    assert result.stdout == ""
    assert result.stderr.startswith("footfall: ")
    assert words in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("options", [["--suggest", 51], ["--suggest", -1], ["--gravity"], ["--preview", "none"]])
def test_options_that_are_none(ground, options):
    run("map", ground, "--leg", LEG, *options, code=2)
