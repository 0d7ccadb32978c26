"""Programme data (IEEE 488.2, 7.7) and the parameters that judge it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.serve.scpi._data import Element, elements
from macromicro.serve.scpi._parameters import Flag, NameOrBlock, Number, Text, Word, read_values
from macromicro.serve.scpi.errors import ScpiError

LENGTH = Number("position", "m", -10.0, 10.0)


def one(text: str | bytes) -> Element:
    data = text.encode() if isinstance(text, str) else text
    found, _ = elements(data, 0)
    assert len(found) == 1
    return found[0]


def refused(parameter: object, text: str) -> int:
    with pytest.raises(ScpiError) as found:
        read_values((parameter,), elements(text.encode(), 0)[0])  # type: ignore[arg-type]
    return found.value.number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("42.123 MM", 0.042123),
        ("42.123mm", 0.042123),
        ("42.123e0 Mm", 0.042123),
        ("0.042123 M", 0.042123),
        ("42123 UM", 0.042123),
        ("4.2123 cm", 0.042123),
        ("+.042123M", 0.042123),
        ("42123E-3\tMM", 0.042123),
        ("-1 MM", -0.001),
        ("0 MM", 0.0),
        ("\x001\x0bMM\x00", 0.001),  # all up to the space but the newline is white space
    ],
)
def test_units_of_length(text: str, value: float) -> None:
    """The same length in any unit is the same float."""
    assert LENGTH.read(one(text)) == value


@given(st.integers(-9_999_999, 9_999_999))
def test_units_are_equal(nanometres: int) -> None:
    """A length in mm, um, cm and m is one float."""
    digits = f"{abs(nanometres):08d}"
    sign = "-" if nanometres < 0 else ""
    number = abs(nanometres)
    as_mm = f"{sign}{number // 1_000_000}.{number % 1_000_000:06d} MM"
    as_um = f"{sign}{number // 1000}.{number % 1000:03d} UM"
    as_m = f"{sign}{digits}E-9 M"
    values = {LENGTH.read(one(t)) for t in (as_mm, as_um, as_m)}
    assert len(values) == 1
    assert values.pop() == float(f"{nanometres}e-9")


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("42.123 MMM", -131),
        ("42.123 V", -131),
        ("42.123 S", -131),
        ("42.123 COUNTS", -131),
        ("42.123", -131),
        ("42.123 MM/S", -131),
        ("42 MILLIMETRESLONG", -134),
        ("NAN", -104),
        ("INF", -104),
        ('"42 MM"', -104),
        ("#13abc", -104),
        ("11 M", -222),
        ("1E400 MM", -222),
        ("1E-400 MM", -222),
        ("1E32001 MM", -123),
        ("1E999999999999 MM", -123),
        ("1" * 300 + " MM", -124),
        ("0x10 MM", -103),
        ("1,2 MM", -108),
        ("1.2.3 MM", -121),
        ("--1 MM", -121),
        ("1 MM MM", -103),
        ("(1) MM", -178),
        ("@ MM", -101),
        ("", -109),
        (",", -109),
        ("1 MM,", -109),
    ],
)
def test_what_is_no_length(text: str, number: int) -> None:
    assert refused(LENGTH, text) == number


def test_numbers_without_a_unit() -> None:
    mask = Number("mask", lo=0, hi=255, whole=True)
    for text in ("31", "31.0", "3.1E1", "#H1F", "#h1f", "#Q37", "#B11111"):
        assert mask.read(one(text)) == 31.0
    for text, number in (("31 V", -138), ("256", -222), ("-1", -222), ("1.5", -222)):
        assert refused(mask, text) == number
    counts = Number("position", "counts", -1e6, 1e6, whole=True)
    assert (
        counts.read(one("590 COUNTS")) == counts.read(one("590 count")) == counts.read(one("590"))
    )
    assert refused(counts, "590 MM") == -131


def test_words_and_flags() -> None:
    word = Word("order", ("NORMal", "SWAPped"))
    assert {word.read(one(t)) for t in ("norm", "NORMAL", "Normal")} == {"NORM"}
    assert refused(word, "NORMA") == -224
    assert refused(word, "1") == -104
    flag = Flag("state")
    assert [flag.read(one(t)) for t in ("on", "OFF", "1", "0")] == [True, False, True, False]
    assert [flag.read(one(t)) for t in ("2", "-7.5", "0.4", "1e-9")] == [True, True, False, False]
    for text, number in (("TRUE", -224), ('"ON"', -104), ("1 V", -138)):
        assert refused(flag, text) == number


def test_strings() -> None:
    text = Text("name", 10)
    assert text.read(one('"a ""b"" c"')) == 'a "b" c'
    assert text.read(one("'it''s'")) == "it's"
    assert text.read(one('"Größe"')) == "Größe"
    assert refused(text, '"12345678901"') == -223
    assert refused(text, '"open') == -151
    assert refused(text, "word") == -104
    for bad in (b'"\xff\xfe"', b'"a\0b"'):
        with pytest.raises(ScpiError) as found:
            one(bad)
        assert found.value.number == -151


def test_blocks() -> None:
    given_ = NameOrBlock("programme")
    assert given_.read(one(b"#15ab;\nc")) == b"ab;\nc"
    assert given_.read(one(b"#10")) == b""
    assert given_.read(one(b"#210" + b"x" * 10)) == b"x" * 10
    assert given_.read(one(b'"thesis"')) == "thesis"
    for bad in (b"#15abcd", b"#0abc", b"#", b"#2x1abc", b"#9"):
        with pytest.raises(ScpiError) as found:
            one(bad)
        assert found.value.number == -161


@given(st.binary(max_size=60))
def test_any_bytes_give_elements_or_a_standard_error(data: bytes) -> None:
    try:
        found, end = elements(data, 0)
    except ScpiError as error:
        assert -178 <= error.number <= -101
        return
    assert 0 <= end <= len(data)
    for element in found:
        if element.kind == "number":
            assert not math.isnan(float(element.text))
