"""The tree of errors: each crosses a process boundary and has its own stable kind."""

import copy
import pickle

import pytest

from footfall.core import errors
from footfall.core.errors import FootFallError

KINDS = {
    "FootFallError": ("error", "Exception"),
    "InvalidInput": ("invalid-input", "FootFallError"),
    "InvalidTerrain": ("invalid-terrain", "InvalidInput"),
    "InvalidImages": ("invalid-images", "InvalidInput"),
    "InvalidRobot": ("invalid-robot", "InvalidInput"),
    "InvalidTelemetry": ("invalid-telemetry", "InvalidInput"),
    "InvalidSequence": ("invalid-sequence", "InvalidInput"),
    "InvalidBundle": ("invalid-bundle", "InvalidInput"),
    "NotFound": ("not-found", "FootFallError"),
    "Conflict": ("conflict", "FootFallError"),
    "CommandRefused": ("command-refused", "Conflict"),
    "Busy": ("busy", "Conflict"),
    "Cancelled": ("cancelled", "FootFallError"),
    "WorkerLost": ("worker-lost", "FootFallError"),
    "NotRecorded": ("not-recorded", "FootFallError"),
}
"""REST clients match on these: a change is a change of the interface."""

ALL = [one for one in vars(errors).values() if isinstance(one, type) and issubclass(one, FootFallError)]


def test_the_tree_and_its_kinds_are_stable():
    assert {cls.__name__: (cls.kind, cls.__base__.__name__) for cls in ALL if cls.__base__} == KINDS


def test_kinds_are_unique_and_fit_an_address():
    kinds = [cls.kind for cls in ALL]
    assert len(set(kinds)) == len(kinds)
    assert all(kind.replace("-", "").isalpha() and kind.islower() for kind in kinds)


def test_each_error_stands_in_the_drawn_tree():
    assert errors.__doc__ is not None
    assert all(cls.__name__ in errors.__doc__ for cls in ALL)


@pytest.mark.parametrize("cls", ALL, ids=lambda cls: cls.__name__)
def test_every_error_survives_pickling(cls):
    error = cls("leg 7 does not exist; legs are 0 to 5", leg=7, legs=[0, 5], cls="x", self="y", message="z")
    for back in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(back) is cls
        assert back.message == str(back) == "leg 7 does not exist; legs are 0 to 5"
        assert back.details == error.details
        assert back.kind == cls.kind


def test_details_are_empty_unless_given():
    assert errors.NotFound("no").details == {}
