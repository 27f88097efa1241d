"""Whether this installation can work: libraries, the robot, the page, the samples, the port, the processes."""

import os
import platform
import socket
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version

from footfall.core.value import SOFTWARE_VERSION
from footfall.io.bundles import SESSION
from footfall.resources import sample_sessions_folder, static_folder

LIBRARIES = {
    "numpy": "numpy",
    "scipy": "scipy",
    "pin": "pinocchio",
    "coal": "coal",
    "ompl": "ompl.base",
    "opencv-python-headless": "cv2",
    "rasterio": "rasterio",
    "trimesh": "trimesh",
    "embreex": "embreex.rtcore_scene",
    "pillow": "PIL",
    "fastapi": "fastapi",
    "uvicorn": "uvicorn",
    "websockets": "websockets",
    "viser": "viser",
}


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at. text: what was found, or what to do."""

    what: str
    ok: bool
    text: str


def examine() -> list[Finding]:
    """Look at everything; nothing is changed."""
    findings = [
        Finding("footfall", True, f"{SOFTWARE_VERSION}, Python {platform.python_version()}, {os.cpu_count()} cores")
    ]
    findings += [_library(package, module) for package, module in LIBRARIES.items()]
    checks: dict[str, Callable[[], str]] = {
        "robot": _robot,
        "page": _page,
        "sample sessions": _samples,
        "loopback": _loopback,
        "worker processes": _process,
    }
    return findings + [_finding(what, check) for what, check in checks.items()]


def _finding(what: str, check: Callable[[], str]) -> Finding:
    try:
        return Finding(what, True, check())
    except Exception as error:  # every failure is a finding
        return Finding(what, False, f"{type(error).__name__}: {error}")


def _library(package: str, module: str) -> Finding:
    try:
        import_module(module)
        return Finding(package, True, version(package))
    except (ImportError, OSError, PackageNotFoundError) as error:
        return Finding(package, False, f"{error}; install FootFall again from its lock file")


def _robot() -> str:
    from footfall.io.robot_files import load_robot

    robot = load_robot("athlete")
    return f"{robot.name}, {robot.leg_count} legs, {robot.mass:.0f} kg, digest {robot.digest[:12]}"


def _page() -> str:
    page = static_folder() / "index.html"
    if not page.is_file():
        raise FileNotFoundError(f"{page} is missing; install FootFall again")
    return str(page.parent)


def _samples() -> str:
    folder = sample_sessions_folder()
    names = sorted(path.parent.name for path in folder.glob(f"*/{SESSION}"))
    if not names:
        raise FileNotFoundError(f"{folder} holds no sample session; install FootFall again")
    return ", ".join(names)


def _loopback() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        probe.listen(1)
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", 8080))
        except OSError:
            return "works; port 8080 is in use, so `footfall serve` needs another --port"
    return "works; port 8080 is free"


def _process() -> str:
    run = subprocess.run(
        [sys.executable, "-c", "import footfall"], capture_output=True, text=True, timeout=60, check=False
    )
    if run.returncode:
        raise RuntimeError(run.stderr.strip().splitlines()[-1] if run.stderr.strip() else "a child process failed")
    return "can be started"
