"""What is installed from the wheel holds everything that runs."""

import subprocess
import sys
import zipfile
from pathlib import Path

from tests.support.waiting import BOUND

ROOT = Path(__file__).resolve().parents[2]


def test_the_wheel_holds_page_samples_and_robot(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(ROOT)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=BOUND)
    assert run.returncode == 0, run.stderr
    (wheel,) = tmp_path.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    folders = {
        "static": "_static",
        "sample_sessions": "_sample_sessions",
        "backend/footfall/robot/assets": "robot/assets",
    }
    for source, inside in folders.items():
        files = [p.relative_to(ROOT / source) for p in (ROOT / source).rglob("*") if p.is_file() and p.suffix != ".pyc"]
        missing = [str(p) for p in files if f"footfall/{inside}/{p.as_posix()}" not in names]
        assert files
        assert not missing
