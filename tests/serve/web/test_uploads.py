"""Programmes that come piece by piece."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from web_parts import Station

from macromicro import programme
from macromicro.serve._instrument import Instrument
from macromicro.serve.web import _downloads
from macromicro.serve.web._downloads import Upload
from macromicro.serve.web._orders import Orders, Refusal

LOAD = Orders(Instrument(Station())).programme
TEXT = '[[moves]]\nmacro = "10 counts"\nhold = "1 s"\n'


def piece(text: str, offset: int = 0, name: str = "a.toml", last: bool = False) -> dict[str, Any]:
    return {"name": name, "offset": offset, "text": text, "last": last}


def test_pieces_become_a_plan() -> None:
    upload = Upload()
    assert upload.take(piece(TEXT[:10]), LOAD) == {"size": 10}
    assert upload.plan is None
    assert upload.take(piece(TEXT[10:], 10, last=True), LOAD) == {"size": len(TEXT), "moves": 1}
    assert upload.plan is not None
    assert upload.plan.target.tolist() == [10.0]


def test_a_new_upload_drops_the_one_before() -> None:
    upload = Upload()
    upload.take(piece(TEXT, last=True), LOAD)
    upload.take(piece(TEXT[:5]), LOAD)
    assert upload.plan is None


@pytest.mark.parametrize(
    ("second", "words"),
    [
        (piece("x", 5), "a piece at 5"),
        (piece("x", 11), "a piece at 11"),
        (piece("x", 10, "b.toml"), "a piece at 10 of b.toml"),
        ({"name": "a.toml", "offset": 10, "text": None}, "without text"),
        (piece("x", 10, "../a.toml"), "is not a file name of a programme"),
        (piece("x", 10, "a.py"), "is not a file name of a programme"),
    ],
)
def test_a_piece_that_does_not_fit_is_refused(second: dict[str, Any], words: str) -> None:
    upload = Upload()
    upload.take(piece(TEXT[:10]), LOAD)
    with pytest.raises(Refusal, match=words):
        upload.take(second, LOAD)


def test_what_is_too_long_is_refused_and_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_downloads, "MOST", 15)
    upload = Upload()
    upload.take(piece("x" * 10), LOAD)
    with pytest.raises(Refusal, match="more than 15 characters"):
        upload.take(piece("x" * 10, 10), LOAD)
    with pytest.raises(Refusal, match="a piece at 20"):
        upload.take(piece("x", 20), LOAD)


def test_a_slip_is_reported_with_the_files_own_name() -> None:
    with pytest.raises(Refusal) as caught:
        Upload().take(piece(TEXT.replace("10", "99999"), last=True), LOAD)
    assert caught.value.reply.reason.startswith("a.toml")
    assert "/" not in caught.value.reply.reason.split(":")[0]


def test_nothing_stays_on_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Path] = []

    real = programme.load

    def load(path: Path, limits: object) -> programme.Programme:
        seen.append(path)
        assert path.read_text(encoding="utf-8") == TEXT
        return real(path, limits)  # type: ignore[arg-type]

    monkeypatch.setattr(programme, "load", load)
    Upload().take(piece(TEXT, last=True), LOAD)
    assert seen and not seen[0].parent.exists()
