"""Artifacts are read as numpy would read them, but for syntax trees, which fail now and then among threads."""

import ast
import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes

from footfall.core.grid import GridGeometry
from footfall.io.artifacts import _array, decode, encode

KINDS = ["<f8", ">f4", "<i8", "|u1", "|b1", "<u2", "<c16", "<U5", "|S3"]


def written(array: np.ndarray) -> bytes:
    out = io.BytesIO()
    np.lib.format.write_array(out, array, (1, 0))
    return out.getvalue()


def read(content: bytes) -> np.ndarray:
    return _array(np.frombuffer(content, np.uint8))


@given(st.sampled_from(KINDS), st.one_of(st.just(()), array_shapes(min_dims=1, min_side=0, max_side=20)), st.booleans())
def test_every_array_is_read_as_numpy_reads_it(kind, shape, saved):
    array = np.arange(int(np.prod(shape))).reshape(shape).astype(kind)
    out = io.BytesIO()
    if saved:
        np.save(out, array)
    content = out.getvalue() or written(array)
    found, theirs = read(content), np.load(io.BytesIO(content))
    assert (found.dtype, found.shape) == (theirs.dtype, theirs.shape)
    np.testing.assert_array_equal(found, theirs)


HEAD = written(np.zeros((2, 3)))


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (HEAD.replace(b"<f8", b"<f3"), "unknown kind"),
        (HEAD.replace(b"<f8", b"|O8"), "does not fit its header"),
        (HEAD.replace(b"<f8", b"<f4"), "does not fit its header"),
        (HEAD.replace(b"(2, 3)", b"(2, 4)"), "does not fit its header"),
        (HEAD.replace(b"False", b"True "), "unknown format"),
        (HEAD.replace(b"False", b"(1,2)"), "unknown format"),
        (HEAD.replace(b"\x01\x00", b"\x02\x00", 1), "unknown format"),
        (HEAD[:8] + b"\x10\x00" + HEAD[10:], "unknown format"),
        (HEAD[:-1], "does not fit its header"),
        (HEAD[:40], "unknown format"),
        (b"", "unknown format"),
    ],
)
def test_what_a_header_claims_is_not_believed(content, why):
    with pytest.raises(ValueError, match=why):
        read(content)


def test_no_syntax_tree_is_built_of_a_header(monkeypatch):
    """CPython before 3.13 counts how deep trees are for all threads together, and takes one for the other."""

    def refused(*_):
        raise SystemError("AST constructor recursion depth mismatch")

    value = GridGeometry(1.0, 2.0, 0.1, 3, 4)
    content = encode(value)
    monkeypatch.setattr(ast, "literal_eval", refused)
    assert decode(content, expect=value.digest).digest == value.digest
