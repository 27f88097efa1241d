"""What starts fast stays fast: naming products must not load the libraries that compute them."""

import subprocess
import sys

import pytest

COMPUTING = ("numba", "cv2", "pinocchio", "coal", "ompl", "scipy")
"""They take from a tenth of a second to a whole one."""


@pytest.mark.parametrize("module", ["footfall.session.registry", "footfall.cli"])
def test_sessions_and_the_command_line_start_without_what_computes(module):
    script = f"import sys, {module}; print(*(name for name in {COMPUTING!r} if name in sys.modules))"
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == []


def test_a_rover_starts_without_what_reads_maps_of_others():
    """Its world is a file of ours; it is started again with each session."""
    script = "import sys, footfall.sim.__main__; print(*(n for n in ('rasterio', 'trimesh') if n in sys.modules))"
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == []
