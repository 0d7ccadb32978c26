"""One short run, shared by the tests of the report."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.runs import job as run
from macromicro.runs.job import Ended

PROGRAMME = """
title = "Short <b>& quick</b>"

[[moves]]
macro = ["40 mm"]
micro = ["1.5 mm", "0.3 mm"]
hold = "1.2 s"

[[moves]]
macro = ["0 mm"]
micro = ["0.5 mm"]
hold = "1.2 s"
"""
CONFIG = '[sensors.laser]\nnoise = "0.5 um"\n'


@pytest.fixture(scope="session")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Ended:
    """A run of two cycles with one setting changed."""
    place: Path = tmp_path_factory.mktemp("short")
    (place / "short.toml").write_text(PROGRAMME)
    (place / "config.toml").write_text(CONFIG)
    job = run.check(
        run.Request(
            programme=str(place / "short.toml"),
            out=place / "out",
            config=place / "config.toml",
            cycles=2,
            seed=3,
        )
    )
    return run.execute(job)
