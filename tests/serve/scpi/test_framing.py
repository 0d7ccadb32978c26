"""Bytes to messages: however they are cut, and whatever they are."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from macromicro.serve.scpi._intake import Framer
from macromicro.serve.scpi.errors import ScpiError


def numbers(found: list[bytes | ScpiError]) -> list[bytes | int]:
    return [f.number if isinstance(f, ScpiError) else f for f in found]


def test_lines() -> None:
    found = list(Framer().feed(b"*IDN?\r\nMOVE 1 MM;*OPC?\n\nrest"))
    assert found == [b"*IDN?\r", b"MOVE 1 MM;*OPC?", b""]


def test_a_block_may_hold_newlines_and_commands() -> None:
    text = b"PROG:LOAD #216\nMOVE:ABS 1 MM\n;*IDN?\n*CLS\n"
    assert list(Framer().feed(text)) == [b"PROG:LOAD #216\nMOVE:ABS 1 MM\n;*IDN?", b"*CLS"]


def test_a_number_sign_in_a_string_is_no_block() -> None:
    assert list(Framer().feed(b'A "#15"\nB\n')) == [b'A "#15"', b"B"]
    assert list(Framer().feed(b"A #H1F\nB\n")) == [b"A #H1F", b"B"]


@given(st.binary(max_size=300), st.lists(st.integers(1, 40), min_size=1, max_size=30))
def test_cuts_do_not_matter(data: bytes, cuts: list[int]) -> None:
    """A stream gives the same messages in one piece and in many."""
    whole = numbers(list(Framer(64, 32).feed(data + b"\n")))
    framer, place, pieces = Framer(64, 32), 0, []
    k = 0
    while place < len(data) + 1:
        step = cuts[k % len(cuts)]
        pieces += list(framer.feed((data + b"\n")[place : place + step]))
        place, k = place + step, k + 1
    found = numbers(pieces)
    # Where a limit is met in the middle of a piece, only the error's number may differ.
    assert len(found) == len(whole)
    for a, b in zip(found, whole, strict=True):
        assert a == b or (isinstance(a, int) != isinstance(b, int)) or {a, b} <= {-223, -363}


def test_a_long_line_is_one_error_and_what_follows_is_heard() -> None:
    framer = Framer(1000, 500)
    found = list(framer.feed(b"x" * 1_000_000 + b"\n*IDN?\n"))
    assert numbers(found) == [-363, b"*IDN?"]
    assert framer.held == 0


def test_a_block_that_is_too_long_ends_it_all_at_once() -> None:
    """Its head is enough; nothing behind it becomes a command, or is kept."""
    framer = Framer(1000, 500)
    found = list(framer.feed(b"*IDN?\nPROG:LOAD #9999999999\nMOVE:ABS 10 MM\n"))
    assert numbers(found) == [b"*IDN?", -223]
    assert framer.broken and framer.held == 0
    assert list(framer.feed(b"x" * 10_000 + b"\nMOVE:ABS 10 MM\n")) == []
    assert framer.held == 0


def test_it_tells_that_it_waits_for_a_block() -> None:
    framer = Framer()
    assert list(framer.feed(b"A #15ab")) == [] and framer.in_block
    assert list(framer.feed(b"cde;STOP\n")) == [b"A #15abcde;STOP"] and not framer.in_block
    assert list(framer.feed(b"A ")) == [] and not framer.in_block


@given(st.lists(st.sampled_from([b"x" * 5000, b'"', b"#", b"9", b"\0", b"#3100", b"'", b"MOVE"])))
def test_memory_is_bounded(pieces: list[bytes]) -> None:
    """Whatever is sent without ever ending a message."""
    framer = Framer(1000, 500)
    for piece in pieces * 20:
        for _ in framer.feed(piece):
            pass
        assert framer.held <= 1000 + 500 + 4096


def test_blocks_of_one_message_count_together() -> None:
    framer = Framer(1000, 500)
    found = list(framer.feed(b"A #3300" + b"b" * 300 + b",#3300" + b"\n" * 300 + b"\nB\n"))
    assert numbers(found) == [-223]


def test_it_counts_what_takes_time() -> None:
    framer = Framer()
    list(framer.feed(b"x" * 10_000 + b"\n"))
    assert framer.steps == 1
    list(framer.feed(b'"' * 10_000 + b"\n"))
    assert framer.steps == 10_002
