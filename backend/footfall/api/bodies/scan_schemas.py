"""The bodies of requests about scans."""

from typing import Annotated, Any, Literal

from annotated_types import Len
from pydantic import Field

from footfall.api.bodies.schemas import Number, _examples
from footfall.api.bodies.settings_models import Strictly, settings_model
from footfall.terrain.scan import ScanSettings

ScanSettingsModel = settings_model(ScanSettings)
Pixels = Annotated[float, Field(ge=-1e6, le=1e6)]
FocalLength = Annotated[float, Field(gt=0, le=1e6)]


class DepthCalibration(Strictly):
    """Of a rectified depth image [px]; depth_scale: metres of one count."""

    focal_length: FocalLength | None = None
    fx: FocalLength | None = None
    fy: FocalLength | None = None
    cx: Pixels
    cy: Pixels
    depth_scale: Annotated[float, Field(gt=0, le=1e3)] | None = None

    def members(self) -> dict[str, Any]:
        return self.model_dump(exclude_none=True)


class ScanOptions(Strictly):
    """What an uploaded scan does not say itself. pose: of the sensor, x, y, z [m], qw, qx, qy, qz, site frame."""

    model_config = _examples(
        {"unit": "m", "up": "z", "settings": {"resolution": 0.02}},
        {"unit": "m", "pose": [0.0, 0.0, 1.6, 1.0, 0.0, 0.0, 0.0]},
    )
    unit: Literal["m", "cm", "mm", "km", "ft", "us-ft"] | None = None
    up: Literal["x", "y", "z", "-x", "-y", "-z"] | None = None
    pose: Annotated[list[Number], Len(7, 7)] | None = None
    calibration: DepthCalibration | None = None
    settings: ScanSettingsModel | None = None  # type: ignore[valid-type]
