"""Every claim's measured values and verdict, over the whole reproduction."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from .record import frozen


@pytest.mark.slow
def test_reproduce(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "macromicro", "reproduce", "--out", tmp_path / "p"],
        check=True,
        capture_output=True,
        timeout=900,
    )
    rows = json.loads((tmp_path / "p" / "claims.json").read_text(encoding="utf-8"))
    frozen("reproduce", {row["id"]: row for row in rows})
