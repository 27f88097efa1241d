"""Numbers and text as files write them: what only Python reads is none."""

import math

import pytest

from footfall.core.misread import Unreadable
from footfall.core.written import how_to_write, number_of, require_plain_numbers, utf8_of


@pytest.mark.parametrize("word", ["1", "-1.5", "+.5", "2.", "1e5", "1.5E-3", " 7 ", "inf", "-Infinity"])
def test_what_every_program_reads_is_read(word):
    assert number_of(word) == float(word)


@pytest.mark.parametrize("word", ["0.66_5", "１.5", "٣", "1,5", "0x10", "1d3", "", "x", "1 2"])
def test_other_words_are_no_numbers(word):
    assert number_of(word) is None


def test_nan_is_a_number():
    assert math.isnan(number_of("NaN") or 0.0)


@pytest.mark.parametrize(
    ("word", "meant"), [("0.66_5", "0.665"), ("１.5", "1.5"), ("1,5", "1.5"), ("\u22120.5", "-0.5")]
)
def test_what_was_meant_is_told(word, meant):
    assert how_to_write(word).endswith(f": {meant}")
    assert how_to_write("soon") == ""


def test_the_line_is_told_and_names_and_comments_are_passed_over():
    text = "o part_1_2\nusemtl 1_0\n# 1_0 höhe\nv 1 0.0_5 0\n".encode()
    with pytest.raises(Unreadable, match=r"line 4 has '0.0_5', which is no number"):
        require_plain_numbers(text)
    require_plain_numbers(text.replace(b"0.0_5", b"0.05"))
    require_plain_numbers("1 2 3 größe\n".encode("latin-1"))


@pytest.mark.parametrize("coding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_text_of_two_bytes_is_called_so(coding):
    with pytest.raises(Unreadable, match="UTF-16 text; save it as UTF-8"):
        utf8_of("a: 1\n".encode(coding))


def test_other_text_is_called_by_its_place():
    with pytest.raises(Unreadable, match="byte 6, in line 2, is not of UTF-8; save it as UTF-8"):
        utf8_of("a\nhallä".encode("latin-1"))
    assert utf8_of("\ufeffä".encode()) == "ä"
