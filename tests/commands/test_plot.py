"""`macromicro plot`: a page and pictures of a recording, and what cannot be drawn."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from macromicro import cli
from tests.report.plotted import content, made, unpacked

BEGINS = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF", ".html": b"<!DOCTYPE html>"}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of a run, where the command is called."""
    (tmp_path / "ramp").mkdir()
    made().save(tmp_path / "ramp" / "recording.h5")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def plot(words: str) -> int:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["macromicro", "plot", *words.split()])
        return cli.main()


def test_a_page_and_a_picture_where_nothing_is_said(here: Path) -> None:
    assert plot("ramp") == 0
    made_here = {p.name for p in (here / "results" / "plot").iterdir()}
    assert made_here == {"ramp.html", "ramp.png"}
    page = (here / "results/plot/ramp.html").read_text()
    assert "<h1>ramp</h1>" in page and len(content(page)["sides"][0]["columns"]) == 3


def test_columns_span_and_formats_are_chosen(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outs = [f"new/a{suffix}" for suffix in BEGINS]
    asked = "ramp/recording.h5 place phase --from 500ms --to 1s "
    assert plot(asked + " ".join(f"--out {out}" for out in outs)) == 0
    assert capsys.readouterr().out.splitlines() == [f"results: {out}" for out in outs]
    for out, begin in zip(outs, BEGINS.values(), strict=True):
        assert (here / out).read_bytes().startswith(begin)
    (side,) = content((here / "new/a.html").read_text())["sides"]
    assert set(side["columns"]) == {"place", "phase"}
    t = unpacked(side["t"], "<f8")
    assert (t[0], t[-1], len(t)) == (0.5, 1.0, 501)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("ramp plac", "column: 'plac'; accepted: t, stage_reference, place, phase"),
        ("ramp t", "columns: 't'; accepted:"),
        ("nowhere.h5", "no such file"),
        ("new", "new: the folder has no recording.h5"),
        ("ramp --out a.gif", "--out a.gif: '.gif'; accepted: one of .html, .png, .svg, .pdf"),
        ("ramp --out there.png", "--out there.png: the file already exists"),
        ("ramp --from 3", "--from: '3'; accepted: a finite number and its unit: s, ms"),
        ("ramp --from 9s", "there is no row from 9 to 3.999 s. The rows go from 0 to 3.999 s"),
    ],
)
def test_bad_input(here: Path, words: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    """One message, exit 2, nothing written."""
    (here / "there.png").touch()
    (here / "new").mkdir()
    before = sorted(here.rglob("*"))
    assert plot(words) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1, told
    assert sorted(here.rglob("*")) == before


def test_an_existing_file_is_replaced_where_that_is_asked(here: Path) -> None:
    (here / "there.png").touch()
    assert plot("ramp --out there.png --overwrite") == 0
    assert (here / "there.png").read_bytes().startswith(BEGINS[".png"])
