"""Work that goes ahead: in order, the errors of each with itself, and no more of it once nobody wants it."""

import threading
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.pipelined import pipelined
from tests.support.waiting import BOUND


@given(st.lists(st.integers()))
def test_each_thing_comes_with_what_was_made_of_it_in_order(things):
    with closing(pipelined(lambda one: 2 * one, things)) as following:
        assert [(one, made.result()) for one, made in following] == [(one, 2 * one) for one in things]


def test_an_error_is_of_its_own_thing_alone():
    with closing(pipelined(lambda one: 12 // one, [3, 0, 4])) as following:
        (_, first), (_, second), (_, third) = following
    assert (first.result(), third.result()) == (4, 3)
    with pytest.raises(ZeroDivisionError):
        second.result()


def test_the_later_ones_are_begun_while_this_one_is_used():
    begun = [threading.Event() for _ in range(3)]
    with closing(pipelined(lambda one: begun[one].set(), range(3))) as following:
        next(following)
        assert begun[2].wait(BOUND)


def test_what_was_begun_is_waited_for_and_no_more_is():
    going, go_on, done = threading.Event(), threading.Event(), []

    def work(one):
        going.set()
        go_on.wait(BOUND)
        done.append(one)

    before = threading.active_count()
    with closing(pipelined(work, range(50))) as following:
        next(following)
        assert going.wait(BOUND)
        threading.Timer(0.05, go_on.set).start()
    assert done == [0]
    assert threading.active_count() <= before + 1  # the timer may not have ended yet
