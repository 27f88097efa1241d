"""Photographs of a simulated yard, taken by hand-held stereo cameras that are not rectified, with no robot in view."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from footfall.core import frames
from footfall.io.image_files import LEVEL_FORWARD, write_png
from footfall.sim.render import RenderScene
from footfall.telemetry.calibration import CameraModel, PairCalibration
from footfall.telemetry.images import Camera
from footfall.telemetry.photographs import PhotographedPair
from footfall.terrain.dem import Dem
from footfall.terrain.ground.triangulate import triangulate

SIZE, FOCAL, BASELINE, HEIGHT, DOWN = (320, 240), 230.0, 0.2, 1.6, 0.55

PLACES = {"east": 0.0, "north": 1.6, "west": 3.1}
"""Which way each pair looks [rad]; all are taken from about the middle."""


def model(name: str, T_base_camera: np.ndarray, shift: float = 0.0) -> CameraModel:
    width, height = SIZE
    return CameraModel(
        name,
        width,
        height,
        FOCAL + shift,
        FOCAL,
        width / 2 + shift,
        height / 2 - shift,
        "none",
        np.zeros(0),
        T_base_camera,
    )


def rig() -> PairCalibration:
    """Cameras that toe in by a degree and roll by half of one."""
    T_left = frames.transform(frames.rotation("y", DOWN)) @ LEVEL_FORWARD
    turn = Rotation.from_euler("xyz", [0.4, -1.0, 0.5], degrees=True).as_matrix()
    T_right = T_left @ frames.transform(turn, (BASELINE, 0.002, -0.003))
    return PairCalibration("rig", model("rig left", T_left), model("rig right", T_right, 1.5))


def where(name: str) -> np.ndarray:
    """T_site_base of a pair."""
    return frames.transform(frames.rotation("z", PLACES[name]), (0.1 * len(name), 0.0, HEIGHT))


def photograph(ground: Dem, name: str, seed: int = 0) -> PhotographedPair:
    scene, cal, T = RenderScene(triangulate(ground)), rig(), where(name)
    left, right = (
        scene.image(
            Camera(c.name, c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.T_base_camera),
            T,
            np.random.default_rng([seed, side]),
        )
        for side, c in enumerate((cal.left, cal.right))
    )
    return PhotographedPair(name, cal, left, right, 5.0, None, T)


def write(folder: Path, pairs: list[PhotographedPair]) -> None:
    """As `footfall terrain build --images` wants them: images/ with pairs.yaml, and calibration.yaml."""
    images = folder / "images"
    images.mkdir()
    lines = ["format: footfall-pairs", "version: 1", "pairs:"]
    for pair in pairs:
        write_png(pair.left, images / f"{pair.name}_left.png")
        write_png(pair.right, images / f"{pair.name}_right.png")
        lines += [f"  {pair.name}:", f"    time: {pair.time}", f"    T_site_base: {pair.T_site_base.tolist()}"]
    (images / "pairs.yaml").write_text("\n".join(lines) + "\n")
    (folder / "calibration.yaml").write_text(calibration_text(pairs[0].calibration))


def calibration_text(cal: PairCalibration) -> str:
    lines = ["format: footfall-calibration", "version: 1", "pairs:", f"  {cal.name}:"]
    for side, c in (("left", cal.left), ("right", cal.right)):
        lines += [
            f"    {side}:",
            f"      image_size: [{c.width}, {c.height}]",
            f"      intrinsics: [{c.fx}, {c.fy}, {c.cx}, {c.cy}]",
            f"      model: {c.model}",
            f"      T_base_camera: {c.T_base_camera.tolist()}",
        ]
    return "\n".join(lines) + "\n"
