"""The names that scripts use, and what ``import footfall`` costs."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import footfall

HEAVY = (
    "pinocchio", "coal", "ompl", "cv2", "scipy", "trimesh", "embreex", "rasterio", "PIL",
    "fastapi", "pydantic", "uvicorn", "viser", "websockets", "httpx", "typer",
)  # fmt: skip


@pytest.mark.parametrize("name", footfall.__all__)
def test_every_public_name_resolves(name):
    found = getattr(footfall, name)
    if name != "__version__":
        assert callable(found)
        assert found.__doc__
        assert found.__name__ == name


def test_an_unknown_name_is_refused_naming_what_exists():
    with pytest.raises(AttributeError, match="'plan_dance'") as caught:
        _ = footfall.plan_dance  # type: ignore[attr-defined]
    for name in footfall.__all__:
        if name != "__version__":
            assert name in str(caught.value)
    with pytest.raises(ImportError):
        exec("from footfall import plan_dance")


def test_the_version_is_that_of_the_package():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert footfall.__version__ == project["version"]


def test_importing_footfall_alone_loads_no_heavy_library():
    script = f"import sys, footfall; print([name for name in {HEAVY!r} if name in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
