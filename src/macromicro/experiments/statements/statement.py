"""What the thesis states, apart from what was measured."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.experiments.claim import Number


class Statement(NamedTuple):
    """A claim before it is measured: fields as in `Claim`."""

    id: str
    section: str
    claim: str
    printed: Number
    unit: str
    kind: str
    printed_text: str = ""
