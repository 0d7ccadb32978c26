"""The log: rotating file, the journal's levels, and nothing that could disturb the server."""

from __future__ import annotations

import logging
import os
from pathlib import Path

import pytest

from macromicro.errors import InputError
from macromicro.serve import log
from macromicro.serve._ledger import LOG, Trail
from macromicro.serve.log import Log
from tests.systems import linux


def test_a_file_gets_all_a_terminal_what_it_must_know(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("JOURNAL_STREAM", raising=False)
    with Log(tmp_path / "logs" / "serve.log"):
        trail = Trail()
        trail.client("client", "scpi 127.0.0.1:7", "connected")
        for _ in range(2):
            trail.client("token", "scpi 127.0.0.1:7", "this is not the token")
    lines = (tmp_path / "logs" / "serve.log").read_text().splitlines()
    assert [line.split(maxsplit=3)[2] for line in lines] == ["INFO", "WARNING", "WARNING"]
    said = capsys.readouterr().err
    assert said == "macromicro: token: this is not the token by scpi 127.0.0.1:7\n"
    LOG.warning("nobody listens any more")
    assert capsys.readouterr().err == "" and len(lines) == 3


def test_the_journal_is_told_the_levels(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = os.fstat(2)
    with os.fdopen(os.dup(2), "w") as stderr:
        monkeypatch.setattr(log.sys, "stderr", stderr)
        monkeypatch.setenv("JOURNAL_STREAM", f"{found.st_dev}:{found.st_ino}")
        with Log(None):
            for level in (logging.INFO, logging.WARNING, logging.ERROR):
                LOG.log(level, "%s", "words")
    assert capfd.readouterr().err.splitlines() == ["<6>words", "<4>words", "<3>words"]


def test_it_does_not_grow_without_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log, "BYTES", 2000)
    with Log(tmp_path / "a.log"):
        for k in range(1000):
            LOG.info("line %d", k)
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert sorted(sizes) == ["a.log", *(f"a.log.{k}" for k in range(1, log.FILES))]
    assert max(sizes.values()) <= 2000
    assert "line 999\n" in (tmp_path / "a.log").read_text()


@linux
def test_a_full_disk_disturbs_nobody(capsys: pytest.CaptureFixture[str]) -> None:
    with Log(Path("/dev/full")):
        for _ in range(3):
            LOG.info("words")
    assert capsys.readouterr().err == ""


def test_a_place_that_cannot_be_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"--log .*file/below/a.log.*Choose a file in a fold"):
        Log(tmp_path / "file" / "below" / "a.log")
