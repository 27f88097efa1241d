"""Chromium of the tests draws at the priority of other programs: neither before them nor behind them."""

import os

import pytest

from tests.support.browsers import children, command_line


def below(process: int) -> list[int]:
    """All that a process started, and what these started."""
    own = children(process)
    return own + [one for child in own for one in below(child)]


@pytest.mark.usefixtures("console")
def test_pages_get_as_much_of_the_processor_as_the_tests() -> None:
    """A page behind all others gets hardly on beside anything else; for one that nobody looks at that is usual."""
    drawing = [one for one in below(os.getpid()) if "--type=renderer" in command_line(one)]
    assert drawing
    assert {os.getpriority(os.PRIO_PROCESS, one) for one in drawing} == {os.getpriority(os.PRIO_PROCESS, 0)}
