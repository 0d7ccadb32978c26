"""A spec of the fake job."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # for `sweep_fake`, here and in worker processes

Make = Callable[..., Path]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Writes a spec of `samples` random variants, with these options of the fake job."""

    def written(samples: int = 100, name: str = "spec.toml", **options: object) -> Path:
        lines = ['job = "fake"', 'method = "random"', f"samples = {samples}", "[options]"]
        lines += [f"{k} = {v!r}" for k, v in options.items()]
        lines += ["[parameters]", 'gain = { low = 1, high = 100, scale = "log" }']
        lines += ['part.mass = { low = "500 g", high = "2 kg" }']
        path = tmp_path / name
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return written
