"""What `footfall robot init` proposes for made robots, to be edited."""

import re
from pathlib import Path

from tests.support.command_line import run
from tests.support.urdf import written


def proposed(folder: Path, urdf: str) -> Path:
    """The robot.toml that is proposed for a URDF."""
    run("robot", "init", written(folder, urdf), "--samples", 1)
    return folder / "robot.toml"


def edited(path: Path, pattern: str, to: str) -> Path:
    """The same file with each place that looks so changed; there must be one."""
    text, count = re.subn(pattern, to, path.read_text(encoding="utf-8"))
    assert count
    path.write_text(text, encoding="utf-8")
    return path
