"""Files that several commands are given."""

from pathlib import Path

import pytest

from footfall.io.terrain_files import write_terrain
from footfall.terrain.generate import plane


@pytest.fixture
def level(tmp_path) -> Path:
    """A flat terrain in a file."""
    path = tmp_path / "level.npz"
    write_terrain(plane(size=10.0, resolution=0.1), path)
    return path
