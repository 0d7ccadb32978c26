"""Short recordings of known columns, and what a page of them holds."""

from __future__ import annotations

import base64
import json
import re
import zlib
from typing import Any

import numpy as np

from macromicro.columns import Column
from macromicro.recording import Recording

COLUMNS = (
    Column("t", "s", "time"),
    Column("stage_reference", "mm", "set point </script><b>"),
    Column("place", "mm", "position"),
    Column("phase", "1", "phase", "i1"),
)


def made(rows: int = 4000, dt: float = 1e-3, start: float = 0.0, seed: int = 7) -> Recording:
    """A ramp to 4 mm, which the place leaves by a peak of 1 mm in row 1234 and by noise."""
    t = start + dt * np.arange(rows)
    reference = dt * np.arange(rows)
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(rows)
    noise[1234 : 1234 + 1] += 1.0
    arrays = [t, reference, reference + noise, np.arange(rows) // 1000]
    return Recording.from_arrays(COLUMNS, arrays, dt, {"programme": "Ramp & <i>", "seed": seed})


def content(page: str) -> dict[str, Any]:
    """What the page's script reads."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return dict(json.loads(found[1]))


def unpacked(text: str, kind: str = "<f4") -> np.ndarray[Any, Any]:
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), kind)
