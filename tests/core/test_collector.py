"""Python's collector stays off while libraries load, and is as it was after that, whatever happens."""

import gc

import pytest

from footfall.core.collector import none_while_loading


@pytest.fixture
def collector():
    """Puts it back as it was."""
    was = gc.isenabled()
    yield
    (gc.enable if was else gc.disable)()


@pytest.mark.parametrize("before", [True, False])
def test_it_is_off_within_and_as_before_afterwards(collector, before):
    (gc.enable if before else gc.disable)()
    with none_while_loading():
        assert not gc.isenabled()
    assert gc.isenabled() == before
    with pytest.raises(ImportError), none_while_loading():
        raise ImportError
    assert gc.isenabled() == before
