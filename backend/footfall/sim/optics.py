"""What stands between the ground and its image: sun, grain of the ground, lens, exposure and sensor noise.

All of it is simulated: no figure here was measured on a camera of the rover. Images that flatter would promise too
much, so there are two settings with names: "easy", a high sun on well-grained ground, and "hard".
"""

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput, NotFound
from footfall.core.value import Value, value
from footfall.telemetry.images import Camera


@value
class CameraEffects(Value):
    """Settings of the renderer.

    sun_elevation, sun_azimuth: direction to the sun, site frame [rad]; a low sun throws long shadows.
    ambient: share of the light that comes evenly from the sky; all that shadows get.
    ground_contrast: deviation of the ground's albedo, relative to its mean; regolith has little.
    exposure: grey level of a white surface that faces the sun, on the optical axis.
    exposure_difference: the right image is brighter by this share (two cameras, two automatic exposures).
    vignetting: n of a brightness that falls with cosⁿ of the angle to the axis; 4 is the law of a simple lens
        (Kolb, Mitchell & Hanrahan, *A realistic camera model*, SIGGRAPH 1995), wide lenses are built to lose less.
    read_noise: deviation of the noise of a dark pixel [grey levels].
    shot_noise: variance that each grey level of light adds [grey levels]; with the above, the linear sensor model of
        EMVA standard 1288: variance = read_noise² + shot_noise · grey.
    supersampling: n × n rays go through each pixel on whose rim the image changes (adaptive anti-aliasing: Whitted,
        *An improved illumination model*, 1980); 1 casts one ray through every pixel's centre.
    """

    sun_elevation: float = 0.9
    sun_azimuth: float = 2.3
    ambient: float = 0.35
    ground_contrast: float = 0.30
    exposure: float = 290.0
    exposure_difference: float = 0.0
    vignetting: float = 0.0
    read_noise: float = 1.2
    shot_noise: float = 0.0
    supersampling: int = 1

    def check(self) -> None:
        if not 0.0 < self.sun_elevation <= np.pi / 2:
            raise InvalidInput(
                "the sun needs an elevation above 0 and at most π/2 rad", sun_elevation=self.sun_elevation
            )
        if not np.isfinite(self.sun_azimuth):
            raise InvalidInput("the sun needs a finite azimuth [rad]")
        if not (0.0 <= self.ambient <= 1.0 and 0.0 <= self.ground_contrast <= 1.0):
            raise InvalidInput("ambient and ground_contrast are shares between 0 and 1")
        if not (0.0 < self.exposure < np.inf and -1.0 < self.exposure_difference < np.inf):
            raise InvalidInput("exposure needs a number above 0, exposure_difference one above -1")
        if not all(0.0 <= number < np.inf for number in (self.vignetting, self.read_noise, self.shot_noise)):
            raise InvalidInput("vignetting, read_noise and shot_noise need finite numbers of at least 0")
        if not 1 <= self.supersampling <= 8:
            raise InvalidInput("supersampling needs 1 to 8 rays along each side", supersampling=self.supersampling)

    @property
    def sun(self) -> NDArray[np.float64]:
        """Direction to the sun, site frame, (3,)."""
        level = np.cos(self.sun_elevation)
        return np.array(
            [level * np.cos(self.sun_azimuth), level * np.sin(self.sun_azimuth), np.sin(self.sun_elevation)]
        )


EASY = CameraEffects()
"""A sun 52° high, well-grained ground, a perfect lens, one ray a pixel. What the simulated rover sends."""

HARD = CameraEffects(
    sun_elevation=np.deg2rad(14.0),
    ambient=0.2,
    ground_contrast=0.12,
    exposure=430.0,
    exposure_difference=0.15,
    vignetting=2.0,
    read_noise=1.5,
    shot_noise=0.03,
    supersampling=3,
)
"""A sun 14° high, whose shadows are four times as long as things are high and keep a fifth of the light; a grain of
two fifths of the easy one; corners with a third (hazard cameras) to two thirds (navigation cameras) of the light; a
right camera 15 % brighter; shot noise of a sensor with about 8500 electrons to full scale."""

PRESETS = {"easy": EASY, "hard": HARD}


def camera_effects(name: str) -> CameraEffects:
    """The settings of that name; raises NotFound naming those that exist."""
    try:
        return PRESETS[name]
    except KeyError:
        raise NotFound(f"there are no camera effects {name!r}; there are {', '.join(PRESETS)}") from None


def exposed(
    light: NDArray[np.float64],
    rays: NDArray[np.float64],
    camera: Camera,
    effects: CameraEffects,
    gain: float,
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    """The grey image (height, width) that the sensor makes of ``light`` (n,) along ``rays`` (n, 3), z = 1 in the
    camera frame. gain: brightness of this camera relative to the left one."""
    grey = effects.exposure * gain * light
    if effects.vignetting:
        grey *= np.einsum("ij,ij->i", rays, rays) ** (-effects.vignetting / 2)
    noisy = grey + rng.normal(0.0, effects.read_noise, len(grey))
    if effects.shot_noise:
        noisy += np.sqrt(effects.shot_noise * grey) * rng.standard_normal(len(grey))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8).reshape(camera.height, camera.width)
