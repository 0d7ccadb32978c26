"""Whatever bytes come: no exception, no motion by mistake, standard errors, bounded memory."""

from __future__ import annotations

import re

from hypothesis import assume, example, given
from hypothesis import strategies as st

from macromicro.control.live import messages as m
from macromicro.serve.scpi._intake import Framer
from macromicro.serve.scpi._message import all_spellings
from macromicro.serve.scpi.errors import TEXTS, ScpiError
from macromicro.serve.scpi.tree import COMMANDS

HEADERS = sorted({":".join(names) for c in COMMANDS for names, _ in all_spellings(c.header)})
PIECES = st.one_of(
    st.sampled_from(HEADERS).map(str.encode),
    st.sampled_from([b"?", b" ", b";", b":", b",", b"\n", b"\r", b"\t", b'"', b"'", b"#", b"\0"]),
    st.sampled_from([b"1", b"-2.5", b"1e3", b" MM", b"MM/S", b" COUNTS", b"ON", b"#15a\nb;c"]),
    st.binary(max_size=8),
)
GARBAGE = st.lists(PIECES, max_size=40).map(b"".join)
# A reader of its own for the one kind of message below: what the mutated one may mean.
MOVE = re.compile(
    rb"[\0-\x20;]*:?MOVE(?::ABS(?:OLUTE)?)?[\0-\x20]+"
    rb"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:E[+-]?[0-9]+)?)[\0-\x20]*(MM|UM|CM|M|)[\0-\x20;]*",
    re.IGNORECASE,
)
SCALE = {b"MM": 1e-3, b"UM": 1e-6, b"CM": 1e-2, b"M": 1.0, b"": 0.0}


def feed(bench, data: bytes) -> None:
    framer = Framer()
    for found in framer.feed(data + b"\n"):
        if isinstance(found, ScpiError):
            bench.session.fail(found)
        else:
            bench.send(found)
    assert framer.held <= len(data) + 1


def standard(bench) -> None:
    """Every queued error has a number and the text of the standard, in at most 255."""
    while len(bench.session.errors):
        entry = bench.session.errors.get()
        assert entry.number in TEXTS and entry.text.startswith(TEXTS[entry.number])
        assert len(entry.text) <= 255
        assert entry.number != -310, entry.text  # an exception that nobody foresaw


@given(data=st.binary(max_size=400))
@example(data=b"MOVE:ABS")
def test_random_bytes(make_bench, data: bytes) -> None:
    """Bytes that spell no command give no order, to whoever has control."""
    spelled = any(header.encode() in data.upper() for header in HEADERS)
    assume(not spelled or data == b"MOVE:ABS")  # literals of the sources are drawn, too
    bench = make_bench()
    bench.station.acquire("test")
    feed(bench, data)
    assert not [r for r in bench.requests if not isinstance(r, m.Stop)]
    standard(bench)


@given(data=GARBAGE)
def test_random_pieces_of_commands(make_bench, data: bytes) -> None:
    """Without control nothing but stops reaches the station; with it, no exception."""
    watcher = make_bench()
    feed(watcher, data)
    assert all(isinstance(r, m.Stop) for r in watcher.requests)
    standard(watcher)
    bench = make_bench()
    bench.station.acquire("test")
    feed(bench, data)
    standard(bench)
    assert len(bench.session.errors) == 0


@given(
    text=st.sampled_from(
        [b"MOVE:ABS 42.125 MM", b"MOVE 42125 UM", b":MOVE:ABSolute 4.2125e1 MM", b"MOVE .042125M"]
    ),
    place=st.integers(0, 40),
    how=st.sampled_from(["replace", "insert", "delete", "double"]),
    byte=st.integers(0, 255),
)
@example(text=b"MOVE .042125M", place=7, how="replace", byte=10)
def test_a_damaged_move_moves_to_what_it_says_or_not_at_all(
    make_bench, text: bytes, place: int, how: str, byte: int
) -> None:
    """One byte wrong: refused, or still a well-formed command for the place that it says."""
    place %= len(text)
    new = bytes([byte])
    damaged = {
        "replace": text[:place] + new + text[place + 1 :],
        "insert": text[:place] + new + text[place:],
        "delete": text[:place] + text[place + 1 :],
        "double": text[:place] + text[place : place + 1] + text[place:],
    }[how]
    bench = make_bench()
    bench.station.acquire("test")
    feed(bench, damaged)
    moves = [r for r in bench.requests if isinstance(r, m.MoveTo)]
    assert moves == bench.requests
    lines = [x for x in damaged.split(b"\n") if x.strip(bytes(range(33)) + b";")]
    said = [MOVE.fullmatch(line) for line in lines]
    # Nothing is as much in any unit, so only 0 needs none.
    meant = [float(s[1]) * SCALE[s[2].upper()] for s in said if s and (s[2] or not float(s[1]))]
    limits = bench.station.snapshot().limits
    inside = [x for x in meant if limits.whole_low <= x <= limits.whole_high]
    assert len(moves) == len(inside)
    for move, x in zip(moves, inside, strict=True):
        assert abs(move.position - x) < 1e-12
    if not moves:
        assert len(bench.session.errors)
    standard(bench)


@given(
    value=st.floats(0.0, 0.2).map(lambda x: round(x, 9)),
    unit=st.sampled_from(["M", "MM", "UM", "CM"]),
    form=st.sampled_from(["MOVE", "MOVE:ABS", "MOVE:ABSOLUTE", ":MOVE:ABS"]),
    lower=st.booleans(),
    blank=st.sampled_from(["", " ", "\t "]),
)
def test_round_trip(make_bench, value, unit, form, lower, blank) -> None:
    """A position written in any unit, form and case arrives as the same float."""
    from decimal import Decimal

    size = {"M": "1", "MM": "1e-3", "UM": "1e-6", "CM": "1e-2"}[unit]
    text = f"{form} {Decimal(repr(value)) / Decimal(size):f}{blank}{unit}"
    bench = make_bench()
    bench.station.acquire("test")
    bench.ask(text.lower() if lower else text)
    assert bench.requests == [m.MoveTo(value, "test")]


def test_very_long_and_very_many(make_bench) -> None:
    """Limits of one message: commands, parameters, brackets, digits."""
    bench = make_bench()
    for data in (
        b"*IDN?;" * 10_000,
        b"*CLS " + b"1," * 30_000,
        b"A:" * 30_000,
        b"(" * 60_000,
        b"*ESE " + b"9" * 60_000,
        b"*ESE 1" + b"E" + b"9" * 60_000,
        b"\xff" * 60_000,
        b";" * 60_000,
        b"'" * 60_000,
    ):
        feed(bench, data)
    standard(bench)
    assert bench.requests == []
