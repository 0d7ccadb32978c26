"""A reproduction in the terminal."""

from __future__ import annotations

import re
import sys
from typing import Any

import pytest

from macromicro.thesis.page import _counting, terminal
from macromicro.thesis.reproduce import INTERRUPTED, Result, claims_of, failure


def shown(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().out


def test_a_pipe_gets_plain_text(
    reproduced: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    terminal.show(reproduced.results)
    out = shown(capsys)
    assert "\x1b" not in out
    for claim in (c for r in reproduced.results for c in r.claims):
        assert re.search(rf"^{claim.id} .*{claim.verdict}", out, re.MULTILINE), claim.id


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_the_table_fits_and_cuts_nothing(
    columns: int,
    reproduced: Any,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", str(columns))
    terminal.show(reproduced.results)
    lines = re.sub(r"\x1b\[[0-9;]*m", "", shown(capsys)).splitlines()
    claims = claims_of(reproduced.results)
    table = lines[: lines.index("")]
    assert max(map(len, table)) <= max(columns, 80)
    heads = [line for line in table[1:] if not line.startswith(" ")]
    for line, claim in zip(heads, claims, strict=True):
        assert line.startswith(f"{claim.id} ")
        assert line.rstrip().endswith(claim.kind) and claim.verdict in line
    whole = spaced(" ".join(table))
    for claim in claims:
        for words in (claim.claim, claim.basis, claim.rule):
            assert spaced(words) in whole, claim.id


def spaced(text: str) -> str:
    return " ".join(text.split())


def test_shows_the_band_and_why(
    reproduced: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    terminal.show(reproduced.results)
    out = shown(capsys)
    assert re.search(
        r"^D1 +0\.465 +0\.4627 to 0\.4673 +0\.46719 +mm +reproduced", out, re.MULTILINE
    )
    assert "why this band: 70 GPa is a round figure" in out
    assert "rule: the 103MG5 changes most" in out


def test_says_why_claims_differ_and_what_failed(reproduced: Any) -> None:
    lines = terminal.amiss(reproduced.results)
    assert any(line.startswith("D7 differs: ") for line in lines)
    failed = [line for line in lines if line.startswith("lost failed: ValueError")]
    assert len(failed) == 1 and failed[0].endswith("(not measured: Y1, Y2)")
    assert not any(line.startswith("D2") for line in lines)


def test_counts_what_there_is(reproduced: Any) -> None:
    lines = terminal.summary(reproduced.results)
    whole = _counting.counts([c for r in reproduced.results for c in r.claims])
    assert lines[0].startswith(f"{whole.total} claims: {whole.reproduced} reproduced, ")
    kinds = [int(line.split()[0]) for line in lines if line.startswith("  ")]
    assert sum(kinds) == whole.total
    exhibits = [e for r in reproduced.results for e in r.exhibits]
    tables = sum(e.kind == "table" for e in exhibits)
    assert lines[-1] == f"{len(exhibits) - tables} figures and {tables} tables"


def test_one_is_no_plural(reproduced: Any) -> None:
    whole = next(r for r in reproduced.results if r.name == "hall-calibration")
    assert (len(whole.claims), len(whole.exhibits)) == (1, 1)
    lines = terminal.summary([whole])
    assert lines[0].startswith("1 claim: 1 ") and lines[-1] == "1 figure and 0 tables"
    bare = whole._replace(claims=[], exhibits=[])
    assert terminal.summary([bare])[0].startswith("0 claims: ")


def test_nothing_measured_is_no_table(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.show([])
    assert shown(capsys).startswith("0 claims: 0 reproduced")


def test_plain_progress_without_a_terminal(
    reproduced: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    procedures = reproduced.procedures
    with terminal.progress(procedures) as report:
        for p in procedures[::-1]:
            report(Result(p.name, [], [], 0.0), p.seconds)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == f"{procedures[-1].name}: done (1 of {len(procedures)})"
    assert lines[-1].endswith(f"done ({len(procedures)} of {len(procedures)})")


def test_plain_progress_calls_nothing_done_that_is_not(
    reproduced: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = reproduced.procedures[:2]
    with terminal.progress([one, two]) as report:
        report(failure(one, INTERRUPTED), one.seconds)
        report(failure(two, "ValueError: no"), two.seconds)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"{one.name}: interrupted (1 of 2)", f"{two.name}: failed (2 of 2)"]


def test_a_bar_in_a_terminal(
    reproduced: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with terminal.progress(reproduced.procedures) as report:
        for p in reproduced.procedures:
            report(Result(p.name, [], [], 0.0), p.seconds)
    assert reproduced.procedures[0].name in capsys.readouterr().err
