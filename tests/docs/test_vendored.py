"""What the page carries of others is what the lock names, byte for byte, with its licence."""

import hashlib
import json
from pathlib import Path

import pytest

from tests.support.node import PACKAGES

VENDOR = Path(__file__).resolve().parents[2] / "static" / "vendor"
FILES = {"uPlot.esm.js": "dist/uPlot.esm.js", "uPlot.min.css": "dist/uPlot.min.css", "LICENSE": "LICENSE"}


def test_the_lock_pins_what_is_vendored_and_names_no_address() -> None:
    locked = json.loads((VENDOR / "package-lock.json").read_text())["packages"]
    wanted = json.loads((VENDOR / "package.json").read_text())["dependencies"]
    pinned = {name.removeprefix("node_modules/"): one["version"] for name, one in locked.items() if name}
    assert pinned == wanted
    assert all("resolved" not in one for one in locked.values())
    assert all(one["integrity"].startswith("sha512-") for name, one in locked.items() if name)
    assert {path.name for path in VENDOR.iterdir() if path.is_dir()} - {"node_modules"} == set(pinned)
    assert f"v{pinned['uplot']}" in (VENDOR / "uplot" / "uPlot.esm.js").read_text()[:400]
    assert "Permission is hereby granted" in (VENDOR / "uplot" / "LICENSE").read_text()


def test_the_copies_are_those_of_the_package() -> None:
    installed = [VENDOR / "node_modules" / "uplot", PACKAGES / "node_modules" / "uplot"]
    package = next((folder for folder in installed if folder.is_dir()), None)
    if package is None:
        pytest.skip("the package uplot is not installed; static/vendor/README.md says how")
    for copy, original in FILES.items():
        copied, packed = (
            (folder / name).read_bytes() for folder, name in ((VENDOR / "uplot", copy), (package, original))
        )
        assert hashlib.sha256(copied).hexdigest() == hashlib.sha256(packed).hexdigest(), copy
