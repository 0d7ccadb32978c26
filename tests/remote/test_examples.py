"""The example scripts of a served machine run."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from tests.serve.stage.test_served import example, served

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "saved"), [("stream", "stream.csv"), ("capture", "capture.h5")])
def test_it_draws_what_it_has_measured(
    name: str, saved: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "served").mkdir()
    with served(tmp_path / "served", example("screw")) as terminal:
        address = urlsplit(terminal.page)
        where = [str(address.hostname), str(address.port)]
        monkeypatch.setattr(sys, "argv", [name, str(tmp_path / "out"), *where])
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    assert (tmp_path / "out" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "out" / saved).stat().st_size > 1000
