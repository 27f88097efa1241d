"""Laws of frozen values: freezing, digests, the flat form, pickling."""

import copy
import json
import math
import pickle
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import FrozenInstanceError, field, replace
from enum import Enum, StrEnum

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from footfall.core.errors import InvalidInput
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.core.value import (
    LATER,
    FrozenMapping,
    Provenance,
    Value,
    before,
    digest,
    digest_flat,
    flatten,
    stored_name,
    unflatten,
    value,
    value_enum,
)


@value
class CoreTestLater(Value):
    share: float = field(default=0.03, metadata=LATER)
    count: int = field(default=1000, metadata=LATER)
    shift: float = field(default=0.0, metadata=LATER)
    flag: bool = field(default=True, metadata=LATER)


@value
class CoreTestBefore(Value):
    reserve: float = field(default=0.05, metadata=before(0.0))
    way: str = field(default="careful", metadata=before("rigid"))


@value(stored_as="CoreTestOldName")
class CoreTestRenamed(Value):
    size: float = 1.0


@value_enum
class CoreTestColor(Enum):
    RED = "red"
    BLUE = "blue"


@value_enum
class CoreTestWord(StrEnum):
    YES = "yes"


class CoreTestStranger(Enum):
    HERE = 1


@value
class CoreTestInner(Value):
    angle: float
    label: str = ""


@value
class CoreTestOuter(Value):
    array: NDArray[np.float64]
    anything: object = None
    inner: CoreTestInner | None = None
    spare: NDArray[np.float32] | None = None
    named: Mapping[str, NDArray[np.float64]] | None = None


ARRAYS = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.int32, np.int64, np.uint8, np.bool_]),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)
SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from([*CoreTestColor, *CoreTestWord]),
)
ITEMS = st.recursive(
    SCALARS | ARRAYS,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(max_size=5), inner, max_size=3)
        | st.builds(CoreTestInner, angle=st.floats(), label=st.text(max_size=4))
        | st.builds(lambda one: CoreTestOuter(np.zeros(2), one), inner)
    ),
    max_leaves=8,
)


def same(a: object, b: object) -> bool:
    """Equality of content, independent of flatten and digest: NaN equals NaN, types count."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        nan = a.dtype.kind == "f"
        return a.dtype == b.dtype and a.shape == b.shape and np.array_equal(a, b, equal_nan=nan)
    if isinstance(a, Value):
        names = type(a).__dataclass_fields__  # type: ignore[attr-defined]
        return type(a) is type(b) and all(same(getattr(a, name), getattr(b, name)) for name in names)
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return list(a) == list(b) and all(same(a[name], b[name]) for name in a)
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a):
        return math.isnan(b)
    return type(a) is type(b) and a == b


def arrays_in(item: object) -> list[np.ndarray]:
    return flatten(item)[1]


# freezing


def test_fields_cannot_be_set_or_added():
    inner = CoreTestInner(1.0)
    with pytest.raises(FrozenInstanceError):
        inner.angle = 2.0  # type: ignore[misc]
    # slots: no place for a new name (3.11's frozen slotted dataclasses say it with a TypeError)
    with pytest.raises((AttributeError, TypeError)):
        inner.other = 1  # type: ignore[attr-defined]
    assert not hasattr(inner, "__dict__")


@given(ITEMS)
def test_every_array_inside_is_read_only(item):
    for array in arrays_in(CoreTestOuter(np.zeros(3), item)):
        assert not array.flags.writeable
        assert array.flags.c_contiguous


def test_the_givers_array_is_copied_and_stays_writeable():
    mine = np.zeros(3)
    held = CoreTestOuter(mine, {"deep": [mine]})
    before = held.digest
    mine[:] = 7
    assert held.array.tolist() == [0, 0, 0]
    assert held.anything["deep"][0].tolist() == [0, 0, 0]  # type: ignore[index]
    assert digest(held) == before


@pytest.mark.parametrize("view", [lambda a: a[:], lambda a: np.broadcast_to(a, (3,)), lambda a: a.reshape(3, 1)])
def test_a_read_only_view_of_a_writeable_array_is_copied(view):
    mine = np.zeros(3)
    shown = view(mine)
    shown.setflags(write=False)
    held = CoreTestOuter(shown)
    mine[:] = 7
    assert not held.array.any()


def test_read_only_memory_is_shared_not_copied():
    held = CoreTestOuter(np.zeros(5))
    assert np.shares_memory(CoreTestOuter(held.array[1:]).array, held.array)
    frozen = np.frombuffer(bytes(16), np.float64)
    assert CoreTestOuter(frozen).array is frozen
    assert not np.shares_memory(CoreTestOuter(np.frombuffer(bytearray(16), np.float64)).array, frozen)


def test_lists_mappings_and_numpy_scalars_become_plain():
    held = CoreTestOuter(np.zeros(1), [np.float64(0.5), {"k": [1, np.int32(2)]}])
    half, mapping = held.anything  # type: ignore[misc]
    assert type(half) is float
    assert isinstance(mapping, FrozenMapping)
    assert mapping["k"] == (1, 2)
    assert type(mapping["k"][1]) is int
    with pytest.raises(TypeError):
        mapping["k"] = 1  # type: ignore[index]


def test_a_tuple_of_what_is_frozen_is_kept_and_any_other_is_frozen():
    still = (CoreTestInner(0.5), "x", 1, None)
    assert CoreTestOuter(np.zeros(1), still).anything is still
    array = np.zeros(2)
    held = CoreTestOuter(np.zeros(1), (CoreTestInner(0.5), [1], (np.float64(0.5),), array)).anything
    assert held[1:3] == ((1,), (0.5,))  # type: ignore[index]
    assert type(held[2][0]) is float  # type: ignore[index]
    array[0] = 1.0
    assert held[3].tolist() == [0.0, 0.0]  # type: ignore[index]


def test_a_mapping_refuses_names_that_read_the_same():
    with pytest.raises(InvalidInput, match="read the same"):
        FrozenMapping({1: "a", "1": "b"})  # type: ignore[dict-item]


def test_an_array_field_refuses_what_is_no_array_by_name():
    with pytest.raises(InvalidInput, match="array of CoreTestOuter must be an array"):
        CoreTestOuter([1.0, 2.0])  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="vertices of Mesh") as caught:
        Mesh([[0, 0, 0]], np.zeros((0, 3), np.int32))  # type: ignore[arg-type]
    assert caught.value.details["fields"] == ["vertices"]
    with pytest.raises(InvalidInput, match="array of CoreTestOuter"):
        CoreTestOuter(None)  # type: ignore[arg-type]


def test_repr_tells_arrays_by_type_and_shape():
    assert repr(CoreTestOuter(np.zeros((2, 3)), "x" * 200)).startswith("CoreTestOuter(array=<float64 (2, 3)>, ")
    assert len(repr(CoreTestOuter(np.zeros(2), "x" * 2000))) < 300


# digests


@given(ITEMS)
def test_equal_content_has_an_equal_digest(item):
    assert CoreTestOuter(np.zeros(3), item).digest == CoreTestOuter(np.zeros(3), copy.deepcopy(item)).digest


def test_a_digest_is_32_hexadecimal_characters():
    name = CoreTestInner(1.0).digest
    assert len(name) == 32
    assert int(name, 16) >= 0


def test_every_part_of_the_content_counts():
    base = CoreTestOuter(np.zeros(2), 1)
    others = [
        base,
        CoreTestOuter(np.array([0.0, 1e-300]), 1),
        CoreTestOuter(np.zeros((2, 1)), 1),
        CoreTestOuter(np.zeros((1, 2)), 1),
        CoreTestOuter(np.zeros(2), "1"),
        CoreTestOuter(np.zeros(2), True),
        CoreTestOuter(np.zeros(2), 1.0),
        CoreTestOuter(np.zeros(2), [1]),
        CoreTestOuter(np.zeros(2), {"a": 1, "b": 2}),
        CoreTestOuter(np.zeros(2), {"b": 2, "a": 1}),
        CoreTestOuter(np.zeros(2), 1, CoreTestInner(0.0)),
        CoreTestOuter(np.zeros(2), np.zeros(2, np.float32)),
        CoreTestOuter(np.zeros(2), np.zeros(2, np.int32)),
        CoreTestOuter(np.zeros(2), "nan"),
        CoreTestOuter(np.zeros(2), math.nan),
        CoreTestOuter(np.zeros(2), math.inf),
        CoreTestOuter(np.zeros(2), -math.inf),
        CoreTestOuter(np.zeros(2), "red"),
        CoreTestOuter(np.zeros(2), CoreTestColor.RED),
        CoreTestOuter(np.zeros(2), CoreTestColor.BLUE),
    ]
    assert len({one.digest for one in others}) == len(others)


def test_the_class_counts():
    assert CoreTestInner(1.0).digest != Provenance({"angle": "1.0"}).digest
    assert digest((1, 2)) == digest([1, 2])


def test_all_nans_are_one():
    quiet = np.array([0x7FF8000000000000], np.uint64).view(np.float64)
    other = np.array([0xFFF8000000000123], np.uint64).view(np.float64)
    assert quiet.tobytes() != other.tobytes()
    assert CoreTestOuter(quiet).digest == CoreTestOuter(other).digest


def test_equal_numbers_in_other_clothes_have_one_digest():
    assert CoreTestInner(1).digest == CoreTestInner(1.0).digest == CoreTestInner(np.float32(1)).digest  # type: ignore[arg-type]
    assert GridGeometry(0, 0, 1, 2, 3).digest == GridGeometry(0.0, 0.0, 1.0, 2, 3).digest
    want = CoreTestOuter(np.arange(3.0)).digest
    for kind in (np.int64, np.uint8, np.float32, ">f8", ">i4"):
        assert CoreTestOuter(np.arange(3, dtype=kind)).digest == want
    assert CoreTestOuter(np.arange(6.0)[::2]).digest == CoreTestOuter(np.array([0.0, 2.0, 4.0])).digest
    grid = np.arange(6.0).reshape(2, 3)
    assert CoreTestOuter(np.asfortranarray(grid)).digest == CoreTestOuter(grid).digest
    swapped = np.arange(3, dtype=">f4")
    assert digest(swapped) == digest(swapped.astype("<f4"))


def test_a_number_that_would_lose_digits_is_not_converted():
    held = CoreTestOuter(np.zeros(1), spare=np.zeros(1))  # type: ignore[arg-type]
    assert held.spare is not None
    assert held.spare.dtype == np.float64
    assert CoreTestOuter(np.zeros(2, complex)).array.dtype == complex  # type: ignore[arg-type]


def test_the_software_version_is_not_part_of_the_digest():
    one, two = Provenance({"dem": "a"}, software="0.1.0"), Provenance({"dem": "a"}, software="9.9.9")
    assert one.digest == two.digest
    assert CoreTestOuter(np.zeros(1), [one]).digest == CoreTestOuter(np.zeros(1), [two]).digest
    assert one.digest != Provenance({"dem": "b"}).digest
    assert one.digest != replace(one, seed=1).digest
    assert one.digest != replace(one, settings=CoreTestInner(0.0)).digest
    assert CoreTestInner(0.0, "software").digest != CoreTestInner(0.0, "").digest


@pytest.mark.parametrize("words", ["0.03", "1000", "0.0", "true"])
def test_a_later_field_is_left_out_while_it_equals_its_default_wherever_that_came_from(words):
    name = {"0.03": "share", "1000": "count", "0.0": "shift", "true": "flag"}[words]
    same_number = CoreTestLater(**{name: json.loads(words)})  # another object, as one of a file or a request is
    assert same_number.digest == CoreTestLater().digest
    assert flatten(same_number)[0] == {"value": "CoreTestLater", "of": {}}


@pytest.mark.parametrize("other", [{"share": 0.030000001}, {"count": 1001}, {"shift": -0.0}, {"flag": False}])
def test_a_later_field_counts_where_it_is_not_its_default(other):
    assert CoreTestLater(**other).digest != CoreTestLater().digest
    assert same(unflatten(*flatten(CoreTestLater(**other))), CoreTestLater(**other))


SCRIPT = """
import numpy as np
from footfall.core.grid import GridGeometry
from footfall.core.mesh import Mesh
from footfall.core.value import Provenance, digest
mesh = Mesh(np.arange(9.0).reshape(3, 3) / 7, np.array([[0, 1, 2]], np.int32))
grid = GridGeometry(-1.0, 2.5, 0.1, 3, 4)
print(digest([mesh, grid, {"b": float("nan"), "a": Provenance({"x": "y"}, grid, 3)}]))
"""


def test_digests_are_equal_across_processes_and_releases():
    found = {
        subprocess.run(
            [sys.executable, "-c", SCRIPT], env={"PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True
        ).stdout.strip()
        for seed in ("1", "2")
    }
    # recordings name their products by this: it must never change
    assert found == {"54c2ce8cb473b718297f61601d31a5fb"}


# the flat form


@given(ITEMS)
def test_flatten_and_unflatten_are_inverse(item):
    held = CoreTestOuter(np.ones(2), item)
    structure, arrays = flatten(held)
    back = unflatten(structure, arrays)
    assert same(back, held)
    assert back.digest == held.digest


@given(ITEMS)
def test_the_flat_form_survives_json(item):
    structure, arrays = flatten(CoreTestOuter(np.ones(2), item))
    text = json.dumps(structure, allow_nan=False)
    assert same(unflatten(json.loads(text), arrays), unflatten(structure, arrays))


def test_an_enum_that_is_also_a_text_comes_back_as_the_enum():
    held = CoreTestOuter(np.zeros(1), CoreTestWord.YES)
    assert unflatten(*flatten(held)).anything is CoreTestWord.YES


@pytest.mark.parametrize(
    "alien",
    [object(), {1, 2}, b"bytes", 1j, np.array([None, "x"], object), CoreTestStranger.HERE, len],
    ids=lambda one: type(one).__name__,
)
def test_what_has_no_flat_form_is_refused(alien):
    with pytest.raises(InvalidInput, match="part of a value"):
        flatten([alien])
    with pytest.raises(InvalidInput, match="part of a value"):
        _ = CoreTestOuter(np.zeros(1), alien).digest


@pytest.mark.parametrize(
    "structure",
    [
        {"array": 0},
        {"array": "first"},
        {"float": "one"},
        {"map": [["only a name"]]},
        {"map": 3},
        {"enum": "NoSuchEnum", "of": 1},
        {"enum": "CoreTestColor", "of": "green"},
        {"value": "NoSuchValue", "of": {}},
        {"value": ["unhashable"], "of": {}},
        {"value": "CoreTestInner", "of": {"angle": 1.0, "unknown": 2}},
        {"value": "CoreTestInner", "of": {}},
        {"value": "CoreTestInner", "of": {"angle": 10**400}},
        {"value": "CoreTestInner", "of": []},
        {"value": "Mesh", "of": {"vertices": None, "triangles": None}},
        {"value": "GridGeometry", "of": {"x0": "0", "y0": 0.0, "resolution": 1.0, "rows": 1, "cols": 1}},
        {"neither": 1},
        {},
    ],
    ids=lambda one: str(one)[:60],
)
def test_damaged_structures_are_refused_clearly(structure):
    with pytest.raises(InvalidInput):
        unflatten(structure, [])


# pickling and copying


@given(ITEMS)
def test_a_pickle_round_trip_keeps_content_and_read_only_arrays(item):
    held = CoreTestOuter(np.ones(2), item, named={"a": np.ones(2)})
    for back in (pickle.loads(pickle.dumps(held)), copy.deepcopy(held), copy.copy(held)):
        assert same(back, held)
        assert back.digest == held.digest
        assert not any(array.flags.writeable for array in arrays_in(back))


def test_a_mapping_alone_is_read_only_after_pickling():
    back = pickle.loads(pickle.dumps(FrozenMapping({"a": np.ones(2)})))
    assert not back["a"].flags.writeable


def test_the_digest_it_was_stored_under_goes_along_in_a_pickle():
    held = CoreTestInner(1.0)
    object.__setattr__(held, "_digest", "f" * 32)  # as io.artifacts does for files of earlier versions
    assert pickle.loads(pickle.dumps(held)).digest == "f" * 32
    assert replace(held, angle=2.0).digest == CoreTestInner(2.0).digest


def test_replace_checks_again():
    with pytest.raises(InvalidInput):
        replace(GridGeometry(0.0, 0.0, 1.0, 1, 1), rows=0)


# registration


def test_two_values_of_one_name_are_refused():
    with pytest.raises(TypeError, match="CoreTestInner"):

        @value
        class CoreTestInner(Value):
            other: int

    with pytest.raises(TypeError, match="CoreTestColor"):

        @value_enum
        class CoreTestColor(Enum):
            A = 1


def test_what_a_value_meant_before_a_field_came_keeps_its_digest_and_is_read_so():
    old = CoreTestBefore(reserve=0.0, way="".join(["ri", "gid"]))
    structure, arrays = flatten(old)
    assert structure == {"value": "CoreTestBefore", "of": {}}
    assert (read := unflatten(structure, arrays)).reserve == 0.0
    assert read.way == "rigid"
    assert read.digest == old.digest
    assert pickle.loads(pickle.dumps(old)).digest == old.digest


def test_a_default_that_is_not_what_was_meant_before_stands_in_the_flat_form():
    structure, arrays = flatten(CoreTestBefore())
    assert structure["of"] == {"reserve": 0.05, "way": "careful"}
    assert unflatten(structure, arrays).digest == CoreTestBefore().digest


def test_a_class_that_was_renamed_keeps_the_digest_of_what_was_stored():
    structure, arrays = flatten(CoreTestRenamed(2.0))
    assert structure == {"value": "CoreTestOldName", "of": {"size": 2.0}}
    again = unflatten(structure, arrays)
    assert isinstance(again, CoreTestRenamed)
    assert again.digest == digest_flat(structure, arrays)
    assert stored_name(CoreTestRenamed) == "CoreTestOldName"
    assert pickle.loads(pickle.dumps(again)).digest == again.digest


def test_a_stored_name_belongs_to_one_class():
    with pytest.raises(TypeError, match="two values are called CoreTestOldName"):

        @value(stored_as="CoreTestOldName")
        class CoreTestAnother(Value):
            size: float = 1.0
