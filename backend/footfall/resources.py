"""Where the files that ship with FootFall are: in the wheel, or in the source tree."""

from pathlib import Path

_package = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    shipped = _package / f"_{name}"
    return shipped if shipped.is_dir() else _package.parents[1] / name


def static_folder() -> Path:
    """The operator's page."""
    return _folder("static")


def sample_sessions_folder() -> Path:
    """Session bundles for the demo and the tests."""
    return _folder("sample_sessions")


def robot_assets_folder() -> Path:
    """One folder for each robot that ships with FootFall."""
    return _package / "robot" / "assets"
