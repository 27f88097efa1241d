"""Whether this installation can work: libraries, the robot, the page, the sessions' folder, ports, processes, pictures.

What is only useful (a browser on this computer, a graphics card) is told, and no reason to fail.
"""

import os
import platform
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryFile

from footfall.core.errors import FootFallError, InvalidInput
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
    "mujoco-core": "mujoco",
    "mcap": "mcap",
    "foxglove-sdk": "foxglove",
    "argon2-cffi": "argon2",
    "structlog": "structlog",
    "prometheus-client": "prometheus_client",
    "fastapi": "fastapi",
    "uvicorn": "uvicorn",
    "websockets": "websockets",
    "viser": "viser",
}
PORTS = {8080: "the page (serve --port)", 8765: "Foxglove (serve --foxglove)"}
LEAST_FREE = 2 << 30
"""Disk space that a day's recordings and some terrains need [bytes]."""
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSERS = (*CHROMIUMS, "microsoft-edge", "firefox", "safari")


@dataclass(frozen=True)
class Diagnosis:
    """One thing that was looked at. text: what was found, or what to do."""

    what: str
    ok: bool
    text: str


def examine(folder: Path, store: str | None = None) -> list[Diagnosis]:
    """Look at everything; nothing is changed. folder: of the sessions; it need not exist yet.

    store: address of the PostgreSQL database that is to be used; None: the one that the folder names, if any.
    """
    findings = [
        Diagnosis("footfall", True, f"{SOFTWARE_VERSION}, Python {platform.python_version()}, {os.cpu_count()} cores")
    ]
    findings += [_library(package, module) for package, module in LIBRARIES.items()]
    checks: dict[str, Callable[[], str]] = {
        "robot": _robot,
        "page": _page,
        "sample sessions": _samples,
        "sessions folder": lambda: _folder(folder),
        "disk space": lambda: _space(folder),
        "database": lambda: _database(folder, store),
        "login provider": lambda: _provider(folder),
        "loopback": _loopback,
        "ports": _ports,
        "worker processes": _process,
        "pictures without GPU": _pictures,
        "browser": _browser,
    }
    return findings + [_finding(what, check) for what, check in checks.items()]


def _finding(what: str, check: Callable[[], str]) -> Diagnosis:
    try:
        return Diagnosis(what, True, check())
    except FootFallError as error:
        return Diagnosis(what, False, error.message)
    except Exception as error:  # every failure is a finding
        return Diagnosis(what, False, f"{type(error).__name__}: {error}")


def _library(package: str, module: str) -> Diagnosis:
    try:
        import_module(module)
        return Diagnosis(package, True, version(package))
    except (ImportError, OSError, PackageNotFoundError) as error:
        return Diagnosis(package, False, f"{error}; install FootFall again from its lock file")


def _robot() -> str:
    from footfall.io.robot_files import load_robot

    robot = load_robot("athlete")
    return f"{robot.name}, {robot.leg_count} legs, {robot.mass:z.0f} kg, digest {robot.digest[:12]}"


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


def _folder(folder: Path) -> str:
    there = _existing(folder)
    if not os.access(there, os.W_OK | os.X_OK):
        raise PermissionError(f"{there} can't be written by this user; choose another one with --data")
    if there != folder:
        return f"{folder} will be made"
    with TemporaryFile(dir=folder) as probe:
        probe.write(b"x")
        probe.flush()
        os.fsync(probe.fileno())
    others = folder.stat().st_mode & 0o077
    return f"{folder} can be written" + ("; other users of this computer can look into it" if others else "")


def _space(folder: Path) -> str:
    free = shutil.disk_usage(_existing(folder)).free
    if free < LEAST_FREE:
        raise RuntimeError(f"{free / 2**30:z.1f} GiB are free, at least {LEAST_FREE >> 30} GiB are needed")
    return f"{free / 2**30:z.1f} GiB free"


def _database(folder: Path, store: str | None) -> str:
    from footfall.session.storage.databases import binding

    bound = binding(folder)
    url = store or (bound and bound.url)
    if not url:
        return "SQLite, in the sessions folder"
    _require_extra("postgres", "psycopg", "procrastinate", need=url)
    from footfall.session.storage.postgres_look import look

    return f"{look(url, bound)}: {url}"


def _provider(folder: Path) -> str:
    from footfall.io.sign_on_file import FILE, read_sign_on

    settings = read_sign_on(folder)
    if settings is None:
        return f"none ({FILE}); accounts are local"
    _require_extra("oidc", "joserfc", need=FILE)
    from footfall.api.auth.oidc import SignOn, SignOnFailed

    try:
        keys = SignOn(settings).keys()
    except SignOnFailed as error:
        raise InvalidInput(
            f"nobody can log in with {settings.issuer} ({error.message}); see to it, to the network from here to it, "
            f"and to the issuer in {folder / FILE}; local accounts work meanwhile"
        ) from error
    return f"{settings.issuer} answers, and signs with {keys} key{'s' if keys != 1 else ''}"


def _require_extra(extra: str, *modules: str, need: str) -> None:
    for module in modules:
        try:
            import_module(module)
        except ImportError as error:
            text = f"{need} needs the extra `{extra}`: pip install 'footfall[{extra}]' ({error})"
            raise InvalidInput(text) from error


def _existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    return next(one for one in (folder, *folder.absolute().parents) if one.is_dir())


def _loopback() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        probe.listen(1)
        with socket.create_connection(probe.getsockname(), timeout=5):
            return "works"


def _ports() -> str:
    found = [
        f"{port} is {'free' if _is_free(port) else 'in use, choose another'}: {use}" for port, use in PORTS.items()
    ]
    return "; ".join(found)


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True


def _pictures() -> str:
    """The simulated cameras cast rays on the processor; one ray has to meet a triangle."""
    import numpy as np
    import trimesh

    ground = trimesh.Trimesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    hit = ground.ray.intersects_any(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]]))
    if not hit.all():
        raise RuntimeError("a ray missed what lies in its way; install FootFall again")
    return "rays are cast on the processor; the page's 3-D view runs in the browser, with or without a GPU"


def _browser() -> str:
    found = [path for name in BROWSERS if (path := shutil.which(name))]
    try:
        from playwright.sync_api import sync_playwright

        with sync_playwright() as play:
            path = play.chromium.executable_path
            found += [path] if Path(path).exists() else []
    except Exception:  # it is for the tests alone, and may be anything but whole
        pass
    return ", ".join(found) or "none on this computer; any recent one shows the page, through an SSH tunnel too"


def _process() -> str:
    run = subprocess.run(
        [sys.executable, "-c", "import footfall"], capture_output=True, text=True, timeout=60, check=False
    )
    if run.returncode:
        raise RuntimeError(run.stderr.strip().splitlines()[-1] if run.stderr.strip() else "a child process failed")
    return "can be started"
