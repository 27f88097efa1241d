"""Files are read in a process apart: what their parsers do does not happen to the server."""

import os
import signal
import threading

import numpy as np
import pytest

from footfall.core.errors import InvalidInput, InvalidTerrain
from footfall.io.scan_terrain import terrain_from_scan
from footfall.session.reading import ReadingProcess, read_here
from tests.support.waiting import joined, until

SMALL = 64 << 20


@pytest.fixture(scope="module")
def read():
    reading = ReadingProcess(most_memory=SMALL)
    yield reading
    reading.close()


def test_what_a_reader_returns_and_raises_comes_from_another_process(read):
    assert read(os.getpid) == read(os.getpid) != os.getpid()
    assert read_here(os.getpid) == os.getpid()
    assert read(int, "ff", base=16) == 255
    with pytest.raises(InvalidTerrain, match=r"bad\.xyz has no rows of numbers"):
        read(terrain_from_scan, b"# nothing\n", "bad.xyz")
    with pytest.raises(Exception, match="the file can't be read: ZeroDivisionError"):
        read(divmod, 1, 0)


def test_a_scan_read_apart_is_the_same_ground(read):
    rows = "".join(f"{x / 10} {y / 10} {x % 3}\n" for x in range(20) for y in range(20)).encode()
    apart = read(terrain_from_scan, rows, "a.xyz", unit="m", up="z")
    here = terrain_from_scan(rows, "a.xyz", unit="m", up="z")
    assert apart.digest == here.digest
    np.testing.assert_array_equal(apart.heights, here.heights)


def test_a_file_that_takes_too_much_memory_is_refused_and_the_next_is_read(read):
    process = read(os.getpid)
    with pytest.raises(InvalidInput, match="takes more than 64 MiB of memory; send a smaller or coarser one"):
        read(np.ones, SMALL // 8 + 1)
    with pytest.raises(InvalidInput, match="takes more than 64 MiB"):  # also where a parser of ours meets it
        read(terrain_from_scan, b"0 0 0\n" * 2_000_000, "many.xyz", unit="m", up="z")
    assert read(os.getpid) == process


def test_one_that_crashes_its_reader_is_refused_and_the_next_is_read(read):
    process = read(os.getpid)
    with pytest.raises(InvalidInput, match=r"ended the process that read it \(exit code 3\): it is damaged"):
        read(os._exit, 3)
    assert read(os.getpid) not in (process, os.getpid())


def test_one_that_does_not_end_is_given_up():
    reading = ReadingProcess(most_seconds=0.0)
    with pytest.raises(InvalidInput, match="not read within 0 s; send a smaller one"):
        reading(signal.pause)
    reading.close()


def test_closing_ends_what_is_read():
    reading, began, told = ReadingProcess(), threading.Event(), []

    def work() -> None:
        reading(os.getpid)  # it is there
        began.set()
        try:
            reading(signal.pause)
        except InvalidInput as error:
            told.append(error.message)

    thread = threading.Thread(target=work)
    thread.start()
    until(began.is_set, "the process that reads")
    reading.close()
    joined(thread)
    assert len(told) == 1
    assert "ended the process" in told[0] or "the server ends" in told[0]
    with pytest.raises(InvalidInput, match="the server ends, it reads no more files"):
        reading(os.getpid)
