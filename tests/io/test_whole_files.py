"""Files are written whole or not at all, and what is no file stays what it is, at every door of the command line."""

import errno
import os
import stat
from pathlib import Path

import pytest

from footfall.core.errors import InvalidInput, NotFound
from footfall.io.terrain_files import write_terrain
from footfall.io.whole_files import require_writable, write_whole
from footfall.terrain.generate import plane
from tests.support.command_line import run
from tests.support.sequences import SAMPLES


@pytest.fixture
def pipe(tmp_path):
    """A pipe with the ending of every format: what is no file is tried as pipe only, as tests may run as root."""

    def made(ending):
        os.mkfifo(tmp_path / f"pipe{ending}")
        return tmp_path / f"pipe{ending}"

    return made


def test_a_file_is_written_and_written_over_with_its_rights(tmp_path):
    path = tmp_path / "a.json"
    write_whole(path, b"old")
    path.chmod(0o600)
    write_whole(path, b"new")
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert [*tmp_path.iterdir()] == [path]


def test_a_link_stays_a_link_and_what_it_leads_to_is_written(tmp_path):
    (tmp_path / "data").mkdir()
    link = tmp_path / "a.json"
    link.symlink_to(tmp_path / "data" / "b.json")
    write_whole(link, b"new")
    assert link.is_symlink()
    assert (tmp_path / "data" / "b.json").read_bytes() == b"new"


def test_what_is_no_file_is_refused_and_stays(tmp_path, pipe):
    fifo = pipe("")
    (tmp_path / "link").symlink_to(fifo)
    for path in (fifo, tmp_path / "link"):
        with pytest.raises(InvalidInput, match="is a device, a pipe or a socket, and results are written to files"):
            write_whole(path, b"new")
    assert stat.S_ISFIFO(fifo.lstat().st_mode)
    with pytest.raises(InvalidInput, match="is a folder; give the name of a file"):
        write_whole(tmp_path, b"new")
    with pytest.raises(NotFound, match="there is no folder"):
        require_writable(tmp_path / "none" / "a.json")


def test_a_full_disk_leaves_what_was_there(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    write_whole(path, b"old")
    real = Path.write_bytes

    def full(self, content):
        real(self, content[:1])
        raise OSError(errno.ENOSPC, "No space left on device", str(self))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*a\.json'") as failed:
        write_whole(path, b"new")
    assert failed.value.filename == str(path)
    assert path.read_bytes() == b"old"
    assert [*tmp_path.iterdir()] == [path]


def doors(folder):
    """What writes a file, without the name of that, and the ending of the name."""
    ground, step = folder / "ground.npz", SAMPLES / "rock-step"
    place = ["--x", 0, "--y", 0]
    return {
        "export": (["export", step, "--format", "json", "--out"], ".json"),
        "page": (["export", step, "--page", "--out"], ".html"),
        "step": (["plan", "step", ground, *place, "--leg", 0, "--target", 1, 1, "--out"], ".npz"),
        "walk": (["plan", "walk", ground, "--goal", 2, 0, "--out"], ".npz"),
        "gait": (["plan", "gait", ground, "--goal", 2, 0, "--out"], ".npz"),
        "route": (["plan", "route", ground, "--goal", 2, 0, "--out"], ".npz"),
        "map": (["map", ground, *place, "--leg", 0, "--out"], ".tif"),
        "build": (["terrain", "build", step, "--out"], ".tif"),
        "build a scan": (["terrain", "build", "--scan", ground, "--out"], ".tif"),
        "convert": (["terrain", "convert", ground], ".tif"),
        "blend": (["terrain", "blend", ground, ground, "--out"], ".tif"),
        "collision": (["terrain", "collision", ground, "--out"], ".ply"),
    }


@pytest.mark.parametrize("door", doors(Path()))
def test_every_door_refuses_what_is_no_file_before_it_works(door, tmp_path, pipe):
    write_terrain(plane(size=10.0, resolution=0.1), tmp_path / "ground.npz")
    arguments, ending = doors(tmp_path)[door]
    folder = tmp_path / f"folder{ending}"
    folder.mkdir()
    before = sorted(tmp_path.iterdir())
    fifo = pipe(ending)
    for path, words in (
        (fifo, "is a device, a pipe or a socket"),
        (folder, "is a folder"),
        (tmp_path / "none" / f"a{ending}", "there is no folder"),
    ):
        assert words in run(*arguments, path, code=2).output.replace("\n", " ")
    assert stat.S_ISFIFO(fifo.lstat().st_mode)
    assert sorted(tmp_path.iterdir()) == sorted([*before, fifo])
