"""Headers: every spelling of a command finds it, nothing else does (SCPI-99, volume 1, 6)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.serve.scpi._message import Tree, all_spellings, nodes
from macromicro.serve.scpi.command import Command
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.tree import COMMANDS, TREE

SPELLED = [
    (command, names, ranges)
    for command in COMMANDS
    for names, ranges in all_spellings(command.header)
]


def join(command: Command, names: tuple[str, ...], ranges: tuple[object, ...]) -> str:
    parts = [f"{n}1" if r else n for n, r in zip(names, ranges, strict=True)]
    return ":".join(parts) + ("?" if command.query else "")


@given(st.sampled_from(SPELLED), st.randoms(use_true_random=False), st.booleans())
def test_short_long_and_mixed_case_are_one(spelled, random, rooted) -> None:
    command, names, ranges = spelled
    text = join(command, names, ranges)
    text = "".join(random.choice((c.lower(), c.upper())) for c in text)
    text = f":{text}" if rooted and not text.startswith("*") else text
    assert TREE.find(text, ()).command is command


@given(st.sampled_from(SPELLED))
def test_a_spelling_between_short_and_long_is_none(spelled) -> None:
    """6.2.1: only the exact short and the exact long form."""
    command, names, _ = spelled
    if command.header.startswith("*"):
        return
    long = names[-1]
    known = {n for c, n, _ in SPELLED if c.query == command.query}
    for cut in (long[:-1], long[:2]):
        text = (*names[:-1], cut)
        if text not in known:
            with pytest.raises(ScpiError) as found:
                TREE.find(join(command, text, (None,) * len(text)), ())
            assert found.value.number == -113


def test_every_mnemonic_is_legal() -> None:
    """At most 12 characters; the short form is what SCPI's rule makes of the long one: four
    characters, three where the fourth is a vowel (6.2.1)."""
    for command in COMMANDS:
        if command.header.startswith("*"):
            continue
        for node in nodes(command.header):
            short = "".join(c for c in node.text if c.isupper())
            long = node.text.upper()
            assert len(long) <= 12
            rule = long if len(long) <= 4 else long[:3] if long[3] in "AEIOU" else long[:4]
            assert short == rule, command.header


def test_numeric_suffix() -> None:
    assert TREE.find("STAGe:POSition?", ()).suffixes == (1,)
    assert TREE.find("STAG2:POS?", ()).suffixes == (2,)
    for header in ("STAG3:POS?", "STAG0:POS?", "MOVE2:ABS", "STAG99999999999:POS?"):
        with pytest.raises(ScpiError) as found:
            TREE.find(header, ())
        assert found.value.number in (-114, -112)


def test_path_of_the_header_before() -> None:
    """IEEE 488.2, appendix A: SYST:ERR:COUN?;ALL? is below SYST:ERR; a colon starts anew."""
    first = TREE.find("SYST:ERR:COUN?", ())
    assert first.path == ("SYST", "ERR")
    assert TREE.find("ALL?", first.path).command.header == "SYSTem:ERRor:ALL?"
    common = TREE.find("*IDN?", first.path)
    assert common.path == first.path
    with pytest.raises(ScpiError):
        TREE.find("MOVE:ABS", first.path)
    assert TREE.find(":MOVE:ABS", first.path).command.header == "MOVE[:ABSolute]"


def test_two_commands_cannot_share_a_spelling() -> None:
    two = [Command("FETCh[:NOW]?", lambda c: "", ""), Command("FETCh?", lambda c: "", "")]
    with pytest.raises(ValueError, match="twice"):
        Tree(two)


def test_required_common_commands_are_there() -> None:
    """IEEE 488.2, 10.2 and SCPI-99, volume 1, 4.1.1 and 4.2.1."""
    headers = {c.header for c in COMMANDS}
    required = "*CLS *ESE *ESE? *ESR? *IDN? *OPC *OPC? *RST *SRE *SRE? *STB? *TST? *WAI"
    assert set(required.split()) <= headers
    assert {"SYSTem:ERRor[:NEXT]?", "SYSTem:VERSion?", "STATus:PRESet"} <= headers
    for register in ("OPERation", "QUEStionable"):
        for node in ("[:EVENt]?", ":CONDition?", ":ENABle", ":ENABle?"):
            assert f"STATus:{register}{node}" in headers
