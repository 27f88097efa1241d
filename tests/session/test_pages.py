"""What is chosen on one page is chosen on no other, and what a page shows of another's it was asked to show."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from footfall.core.errors import Conflict, InvalidInput
from footfall.planning.step.problem import Footfall
from footfall.session.access.acting import acting
from footfall.session.access.identity import LOCAL, Identity, Role
from footfall.session.choosing import pages as module
from footfall.session.choosing.pages import Choices, Pages

ONE, TWO = (replace(LOCAL, page=page) for page in ("one", "two"))
VIEWER = Identity("vic", Role.VIEWER, page="vic-1")
SEATS = st.sampled_from(["", "local one", "local two"])
LEG = st.integers(0, 5)


def with_leg(leg):
    return lambda own: replace(own, view=own.view.changed(leg=leg))


def of(session, who):
    """What a page shows: its leg, and x of its footfall."""
    chosen = session.choices.of(who)
    return chosen.view.leg, None if chosen.footfall is None else chosen.footfall.x


@given(st.lists(st.tuples(SEATS, LEG), max_size=20))
def test_a_page_has_what_it_or_who_names_no_page_chose_last(acts):
    pages = Pages(Choices())
    for seat in ("local one", "local two"):
        pages.of(seat)
    for seat, leg in acts:
        pages.change(seat, with_leg(leg))
    for mine in ("local one", "local two"):
        assert pages.of(mine).view.leg == next((leg for seat, leg in reversed(acts) if seat in ("", mine)), 0)
    assert pages.of("").view.leg == pages.of("local new").view.leg == (acts[-1][1] if acts else 0)


def test_what_is_refused_changes_no_page():
    pages = Pages(Choices())
    pages.change("local one", with_leg(3))
    with pytest.raises(InvalidInput):
        pages.change("", lambda own: replace(own, view=own.view.changed(layer="stars")))
    with pytest.raises(InvalidInput):
        pages.follow("", True)
    assert [pages.of(seat).view.leg for seat in ("", "local one")] == [3, 3]


def test_of_too_many_pages_the_one_asked_about_longest_ago_begins_anew(monkeypatch):
    monkeypatch.setattr(module, "MOST_PAGES", 2)
    pages = Pages(Choices())
    for leg, seat in enumerate(("a", "b"), 1):
        pages.change(seat, with_leg(leg))
    pages.of("a")
    pages.change("c", with_leg(5))
    assert [pages.of(seat).view.leg for seat in ("a", "c")] == [1, 5]
    assert pages.of("b").view.leg == 5


def test_a_page_s_leg_and_footfall_are_no_other_s(session):
    for who in (ONE, TWO):
        session.choices.of(who)
    for who, leg in ((ONE, 2), (TWO, 4)):
        with acting(who):
            session.choices.set_view(leg=leg)
            session.maps.choose_footfall(leg, 0.1 * leg, 0.5)
            session.choices.set_points(leg, [(0.1 * leg, 0.5, 1.0)])
    for who, leg in ((ONE, 2), (TWO, 4)):
        assert of(session, who) == (leg, pytest.approx(0.1 * leg))
        with acting(who):
            told = session.summary()
            assert (told["view"]["leg"], told["footfall"]["leg"], told["points"]["leg"]) == (leg, leg, leg)
            # what is asked for without a target is asked for of this page's own
            session.plans.step().finish()
            assert session.get(session.state.plan).footfall.digest == Footfall(leg, 0.1 * leg, 0.5).digest


def test_undo_takes_back_what_the_page_that_asks_chose_and_leaves_the_other_s(session):
    for who in (ONE, TWO):
        session.choices.of(who)
    for who, x in ((ONE, 0.1), (TWO, 0.2), (TWO, 0.3)):
        with acting(who):
            session.maps.choose_footfall(1, x, 0.5)
    with acting(ONE):
        session.choices.undo()  # the other's, which that page still shows
    assert [of(session, who)[1] for who in (ONE, TWO)] == [0.1, 0.3]
    with acting(ONE):
        session.choices.redo()
    with acting(TWO):
        session.choices.undo()
    assert [of(session, who)[1] for who in (ONE, TWO)] == [0.1, 0.2]
    with acting(TWO):
        session.choices.redo()
    assert [of(session, who)[1] for who in (ONE, TWO)] == [0.1, 0.3]


def test_a_page_that_follows_shows_what_the_holder_of_the_conn_shows_and_chooses_nothing(session):
    for who, leg in ((ONE, 2), (TWO, 4)):
        with acting(who):
            session.choices.set_view(leg=leg)
            session.maps.choose_footfall(leg, 0.1 * leg, 0.5)
    session.commands.conn_act("take", ONE)
    with acting(TWO):
        assert session.choices.set_view(follows=True).follows
        assert of(session, TWO) == (2, pytest.approx(0.2))
        assert session.choices.concerns(TWO, ONE.seat)
        for choose in (
            lambda: session.choices.set_view(leg=5),
            lambda: session.maps.choose_footfall(5, 0.0, 0.5),
            lambda: session.choices.set_points(5, []),
            lambda: session.hand.hold("footfall"),
            lambda: session.choices.undo(),
        ):
            with pytest.raises(Conflict, match="let it show its own choices"):
                choose()
    with acting(ONE):
        session.choices.set_view(leg=3)
    assert [of(session, who)[0] for who in (ONE, TWO)] == [3, 3]
    with acting(TWO):
        assert not session.choices.set_view(follows=False).follows
        assert of(session, TWO) == (4, pytest.approx(0.4))
        assert not session.choices.concerns(TWO, ONE.seat)
        session.choices.set_view(leg=5)
    assert of(session, ONE)[0] == 3


def test_the_holder_of_the_conn_and_whoever_follows_nobody(session):
    with acting(ONE):
        session.choices.set_view(leg=5)
        session.choices.set_view(follows=True)
    with acting(TWO):
        session.choices.set_view(leg=1)
    assert of(session, ONE)[0] == 1  # nobody holds it: what was chosen last
    session.commands.conn_act("take", ONE)
    with acting(ONE):
        session.choices.set_view(leg=2)
    assert of(session, ONE)[0] == 2
    # a viewer can choose nothing, and sees what others choose
    assert session.choices.of(VIEWER).view.follows
    assert of(session, VIEWER)[0] == 2
    session.commands.conn_act("release", ONE)
    session.choices.set_view(leg=1)
    assert of(session, VIEWER)[0] == 1


def test_what_is_in_hand_is_of_the_page_that_took_it(session):
    for who in (ONE, TWO):
        session.choices.of(who)
    for who, x in ((ONE, 0.1), (TWO, 0.2)):
        with acting(who):
            session.maps.choose_footfall(1, x, 0.5)
    with acting(ONE):
        session.hand.hold("footfall", (0.15, 0.5))
    with acting(TWO):
        with pytest.raises(Conflict):
            session.hand.commit()
        session.maps.choose_footfall(1, 0.3, 0.5)  # and what another chooses meanwhile is no matter
    with acting(ONE):
        assert session.hand.commit()["place"] == [0.15, 0.5]
    assert [of(session, who)[1] for who in (ONE, TWO)] == [0.15, 0.3]
